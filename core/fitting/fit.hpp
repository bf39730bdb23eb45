// EI, GJ and damping of each segment from readings on the bench.
#pragma once

#include "fitting/bench_table.hpp"

#include <limits>
#include <string>
#include <vector>

namespace calot::fitting {

/// A figure with its 95 % confidence interval (Student's t): value -+ half_width.
struct Figure {
    double value = std::numeric_limits<double>::quiet_NaN();
    double half_width = 0;
};

/// One reading against the fit.
struct Residual {
    Reading reading;
    double fitted = 0;         // load: N, N m; amplitude
    double residual = 0;       // load less fitted; of amplitudes: their logarithms' difference
    bool is_set_aside = false; // an outlier: not used
};

/// One kind of test of one segment.
struct SegmentFit {
    std::string segment;
    BenchTest test = BenchTest::bend;
    Figure rigidity;    // bend: EI; twist: GJ, both ways round together, N m2
    Figure right, left; // twist, where both ways have three readings: GJ for positive and negative angles
    Figure decay;       // vibration: 1/s, of the amplitude
    Figure frequency;   // vibration: rad/s
    Figure damping;     // vibration: s, viscous moment per curvature rate over EI: 2 decay / frequency^2
    double rms = 0, worst = 0; // residuals of the readings used
    int used = 0, set_aside = 0;
    std::vector<Residual> residuals; // in the file's order
};

/// Fits each segment and test by itself, in the order in which they first appear.
///   bend: force = EI / span^2 three_point_load(deflection / span), exact for large deflections;
///   twist: torque = GJ angle / length;
///   vibration: amplitude = A exp(-decay t) at successive peaks on the same side, one period apart; a time
///   that goes back begins another recording, with another A. All that is lost is taken for the shaft's own.
/// Of bend and twist, a reading that is farther from a median fit than six times the others' usual distance
/// is set aside. `file` stands in messages. Throws host::UserError naming line and column: a deflection
/// beyond a fifth of the span, too few readings (three; four peaks), readings without extent, a figure that
/// is not positive.
std::vector<SegmentFit> fit(const std::vector<Reading>& readings, const std::string& file);

} // namespace calot::fitting
