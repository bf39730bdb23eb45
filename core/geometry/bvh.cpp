#include "geometry/bvh.hpp"

#include <algorithm>
#include <numeric>

namespace calot::geometry {
namespace {

constexpr int bin_count = 16;
// Past this depth ranges are halved by index: bounds the depth of the tree, hence the stacks that walk it.
constexpr int deepest_heuristic_split = 60;

double half_area(const Box& box) {
    const double x = static_cast<double>(box.hi[0]) - box.lo[0];
    const double y = static_cast<double>(box.hi[1]) - box.lo[1];
    const double z = static_cast<double>(box.hi[2]) - box.lo[2];
    return x < 0 ? 0.0 : x * y + y * z + z * x;
}

struct BinaryNode {
    Box box;
    std::uint32_t first = 0, count = 0; // positions covered
    std::uint32_t left = 0, right = 0;  // 0: leaf
};

class Builder {
  public:
    Builder(std::span<const Box> boxes, std::vector<std::uint32_t>& order) : boxes_(boxes), order_(order) {
        order_.resize(boxes.size());
        std::iota(order_.begin(), order_.end(), 0u);
        scratch_.resize(boxes.size());
        nodes_.reserve(boxes.size());
    }

    std::vector<BinaryNode> run() {
        nodes_.push_back(node_over(0, static_cast<std::uint32_t>(boxes_.size())));
        struct Task {
            std::uint32_t node;
            int depth;
        };
        std::vector<Task> tasks{{0, 0}};
        while (!tasks.empty()) {
            const Task task = tasks.back();
            tasks.pop_back();
            const BinaryNode node = nodes_[task.node];
            if (node.count <= Bvh::leaf_size) continue;
            const std::uint32_t left_count = split(node, task.depth);
            const auto left = static_cast<std::uint32_t>(nodes_.size());
            nodes_.push_back(node_over(node.first, left_count));
            nodes_.push_back(node_over(node.first + left_count, node.count - left_count));
            nodes_[task.node].left = left;
            nodes_[task.node].right = left + 1;
            tasks.push_back({left, task.depth + 1});
            tasks.push_back({left + 1, task.depth + 1});
        }
        return std::move(nodes_);
    }

  private:
    BinaryNode node_over(std::uint32_t first, std::uint32_t count) const {
        BinaryNode node{.box = {}, .first = first, .count = count};
        for (std::uint32_t i = first; i < first + count; ++i)
            node.box.merge(boxes_[order_[i]]);
        return node;
    }

    // Twice the centre: comparable without a division.
    double centre(std::uint32_t index, int axis) const {
        return static_cast<double>(boxes_[index].lo[axis]) + boxes_[index].hi[axis];
    }

    // Reorders the node's positions and returns how many go left (at least 1, at most count - 1).
    std::uint32_t split(const BinaryNode& node, int depth) {
        const std::uint32_t last = node.first + node.count;
        double best_cost = std::numeric_limits<double>::infinity();
        int best_axis = -1, best_bin = 0;
        double best_lo = 0, best_scale = 0;
        for (int axis = 0; axis < 3 && depth < deepest_heuristic_split; ++axis) {
            double lo = std::numeric_limits<double>::infinity(), hi = -lo;
            for (std::uint32_t i = node.first; i < last; ++i) {
                const double c = centre(order_[i], axis);
                lo = std::min(lo, c);
                hi = std::max(hi, c);
            }
            if (!(hi > lo)) continue;
            const double scale = bin_count / (hi - lo);
            std::array<Box, bin_count> bins{};
            std::array<std::uint32_t, bin_count> counts{};
            for (std::uint32_t i = node.first; i < last; ++i) {
                const int bin = bin_of(centre(order_[i], axis), lo, scale);
                bins[bin].merge(boxes_[order_[i]]);
                ++counts[bin];
            }
            std::array<double, bin_count> right_cost{};
            Box box;
            std::uint32_t count = 0;
            for (int b = bin_count - 1; b > 0; --b) {
                box.merge(bins[b]);
                count += counts[b];
                right_cost[b] = half_area(box) * count;
            }
            box = {};
            count = 0;
            for (int b = 0; b + 1 < bin_count; ++b) {
                box.merge(bins[b]);
                count += counts[b];
                if (count == 0 || count == node.count) continue;
                const double cost = half_area(box) * count + right_cost[b + 1];
                if (cost < best_cost) {
                    best_cost = cost;
                    best_axis = axis;
                    best_bin = b;
                    best_lo = lo;
                    best_scale = scale;
                }
            }
        }
        if (best_axis < 0) return node.count / 2;
        // Stable by hand: std::stable_partition allocates at every call.
        std::uint32_t left = node.first, right = 0;
        for (std::uint32_t i = node.first; i < last; ++i) {
            const std::uint32_t index = order_[i];
            if (bin_of(centre(index, best_axis), best_lo, best_scale) <= best_bin)
                order_[left++] = index;
            else
                scratch_[right++] = index;
        }
        std::copy_n(scratch_.begin(), right, order_.begin() + left);
        return left - node.first;
    }

    static int bin_of(double c, double lo, double scale) {
        return std::min(bin_count - 1, static_cast<int>((c - lo) * scale));
    }

    std::span<const Box> boxes_;
    std::vector<std::uint32_t>& order_;
    std::vector<std::uint32_t> scratch_;
    std::vector<BinaryNode> nodes_;
};

} // namespace

void Bvh::build(std::span<const Box> boxes) {
    nodes_.clear();
    order_.clear();
    leaf_begins_.assign(1, 0);
    if (boxes.empty()) return;
    const std::vector<BinaryNode> binary = Builder(boxes, order_).run();

    // Leaves are numbered by the positions they cover.
    std::vector<std::uint32_t> leaf_at(boxes.size());
    for (const BinaryNode& node : binary)
        if (node.left == 0) leaf_at[node.first] = node.count;
    for (std::uint32_t position = 0; position < boxes.size();) {
        const std::uint32_t count = leaf_at[position];
        leaf_at[position] = leaf_count();
        position += count;
        leaf_begins_.push_back(position);
    }

    // Collapse: a wide node takes over the largest inner descendants until its eight slots are full.
    std::vector<std::uint32_t> sources{0}; // the binary node each wide node stands for
    for (std::uint32_t at = 0; at < sources.size(); ++at) {
        std::array<std::uint32_t, width> slots{};
        int used = 1;
        slots[0] = sources[at];
        while (used < width) {
            int widest = -1;
            double area = -1.0;
            for (int i = 0; i < used; ++i) {
                const BinaryNode& candidate = binary[slots[i]];
                if (candidate.left != 0 && half_area(candidate.box) > area) {
                    area = half_area(candidate.box);
                    widest = i;
                }
            }
            if (widest < 0) break;
            const BinaryNode& opened = binary[slots[widest]];
            slots[widest] = opened.left;
            slots[used++] = opened.right;
        }
        Node node{};
        for (int i = 0; i < width; ++i)
            set_box(node, i, Box{});
        for (int i = 0; i < used; ++i) {
            const BinaryNode& source = binary[slots[i]];
            set_box(node, i, source.box);
            if (source.left == 0) {
                node.child[i] = leaf_at[source.first];
                node.leaf[i] = true;
            } else {
                node.child[i] = static_cast<std::uint32_t>(sources.size());
                sources.push_back(slots[i]);
            }
        }
        nodes_.push_back(node);
    }
}

Box Bvh::box_of_children(const Node& node) {
    Box box;
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < width; ++i) {
            box.lo[k] = node.lo[k][i] < box.lo[k] ? node.lo[k][i] : box.lo[k];
            box.hi[k] = node.hi[k][i] > box.hi[k] ? node.hi[k][i] : box.hi[k];
        }
    return box;
}

} // namespace calot::geometry
