// The direct solution of one linearised step, linear in the number of segments.
#pragma once

#include "lanes.hpp"

#include <cstddef>
#include <vector>

namespace calot::rod_direct {

/// Symmetric quasi-definite block-tridiagonal systems of m blocks, each a rotation increment a and a section
/// force n:
///
///   H_j a_j + E_j n_j                     - B a (neighbours)                    = g_j
///   E_j^T a_j - V_j n_j + W_j n_(j-1) + W_(j+1) n_(j+1) (+ Z a of a neighbour)  = r_j
///
/// H, V, W are symmetric, positive (W: semi-) definite: then L D L^T exists in any order, without pivoting
/// (Vanderbei 1995). It is burnt from both ends at once, two independent chains in two lanes, which meet at
/// block `middle()`. W_j joins n_(j-1) and n_j. B of joint j joins a_(j-1) (rows) and a_j (columns):
/// K_j - [c_j] x. Z_j joins a_j with the force of the neighbour on the side of its own end: n_(j-1) for
/// j <= middle(), n_(j+1) otherwise.
class ChainSolver {
  public:
    explicit ChainSolver(int segments);

    int segments() const { return m_; }
    int middle() const { return middle_; }

    // The caller fills these. Segments: m values each.
    std::vector<double> h[6];   ///< H: xx, xy, xz, yy, yz, zz
    std::vector<double> arm[3]; ///< of a plain segment: E = -[arm] x
    std::vector<double> g[3], r[3];
    std::vector<double> soft;         ///< of a plain segment: V = (w_j + w_(j+1) + soft_j) I
    std::vector<unsigned char> plain; ///< else E, V, Z and both W's are the full ones below
    std::vector<double> e[9], v[6], z[9];
    // Nodes and joints: m + 1 values each.
    std::vector<double> k[6], c[3]; ///< of joints; the first and the last are not looked at
    std::vector<double> w;          ///< of nodes beside plain segments: W = w I
    std::vector<double> full_w[6];

    // The solution.
    std::vector<double> a[3], n[3];

    /// Factors and solves; flags in `plain` may be cleared. False: a pivot block was not definite, or not
    /// finite.
    bool solve();

  private:
    template<class V>
    struct Factor {
        Sym<V> p, v_inverse, schur;
        Mat<V> f, q;
        Vec<V> za, zn; // the block's own solution, without what comes from the middle
    };

    template<class V, bool is_plain>
    void eliminate(int slot, V& worst);
    template<class V>
    void substitute(int slot);
    template<class V>
    Factor<V>& factor(int slot);
    void meet(double& worst);
    void match_lanes();

    int m_ = 0, middle_ = 0, pairs_ = 0;
    std::vector<Factor<Pair>> two_; // slot s: block s in lane 0, block m-1-s in lane 1
    Factor<double> one_;            // the block left of the middle without a partner, where m is even
    Factor<double> last_;
};

} // namespace calot::rod_direct
