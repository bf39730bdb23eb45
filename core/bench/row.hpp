#pragma once

#include <limits>
#include <ostream>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace calot::bench {

/// One quantity of a reference problem: what a model gave, what is right, and how far apart they may be.
struct Row {
    std::string problem;
    std::string model;
    int nodes = 0;
    double dt = 0; ///< s
    std::string quantity;
    double measured = 0;
    double reference = std::numeric_limits<double>::quiet_NaN(); ///< NaN: there is none
    double error = 0;
    double bound = std::numeric_limits<double>::infinity(); ///< infinite: printed, not judged
    std::string setting;    ///< what distinguishes rows of the same quantity; in the table only
    std::string remark;     ///< what a reader has to know of the numbers asked for; empty for none
    bool is_claimed = true; ///< by the model's manifest; a row that is not is printed and fails nothing
    bool is_suited = true;  ///< false: the reference does not hold for the numbers asked for; fails nothing

    bool met() const { return error <= bound; }
    bool fails() const { return is_claimed && is_suited && !met(); }
    /// The reference does not hold for the numbers asked for, which no model can help.
    void unsuited(std::string why) { is_suited = false, remark = std::move(why); }
};

/// Columns problem,model,nodes,dt,quantity,measured,reference,error,bound,met. Full precision, "C" locale.
/// met: true, false or unsuited.
void write_csv(std::ostream& out, std::span<const Row> rows);
/// The same for people.
void write_table(std::ostream& out, std::span<const Row> rows);

/// Either of the two, row by row as they come: what has been printed is there whatever happens next. Columns
/// of the table are as wide as what has come so far needs.
class RowPrinter {
  public:
    RowPrinter(std::ostream& out, bool is_csv) : out_(out), is_csv_(is_csv) {}
    /// Prints them, after the header if they are the first, and flushes.
    void print(std::span<const Row> rows);

  private:
    std::ostream& out_;
    bool is_csv_, is_begun_ = false;
    std::vector<std::size_t> width_;
};

} // namespace calot::bench
