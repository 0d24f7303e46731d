// SPDX-License-Identifier: Apache-2.0
#include "core/trace/triangle_tree.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>

#include "core/base/parallel.h"
#include "core/trace/eight_lanes.h"

namespace peeler {
namespace {

// The tree measures in units of 2^kVertexBits cells, so all vertices are in [−1, 1].
constexpr double kCellUnit = TriangleBlock::kUnit;
static_assert(CellGrid::kVertexBits == 50);
constexpr float kEndless = std::numeric_limits<float>::infinity();

/// A box, in the first three lanes.
struct LaneBox {
    FourFloats low = FourFloats{} + kEndless, high = -low;

    void add(const LaneBox& other) {
        low = least(low, other.low);
        high = most(high, other.high);
    }
    /// Returns half the surface area; 0 if the box is empty.
    float area() const {
        const FourFloats size = high - low;
        return size[0] < 0 ? 0 : size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
    }
};

/// The box of a triangle. The last lanes have its number, as floats of 24 and 8 bits.
struct BoxedTriangle {
    LaneBox box;

    FourFloats middle() const { return box.low + box.high; }
    std::uint32_t triangle() const {
        return static_cast<std::uint32_t>(box.low[3]) +
               (static_cast<std::uint32_t>(box.high[3]) << 24);
    }
};

/// Returns a point in units.
FourFloats inUnits(const Cells& cells) {
    const TwoDoubles xy{static_cast<double>(cells[0]), static_cast<double>(cells[1])},
        z{static_cast<double>(cells[2]), 0};
    return toFloats(xy * kCellUnit, z * kCellUnit);
}

BoxedTriangle boxed(const CellCorners& corners, std::uint32_t triangle) {
    BoxedTriangle result;
    for (const Cells& corner : corners) {
        const FourFloats at = inUnits(corner);
        result.box.add({at, at});
    }
    // Outwards by at least one step, which is at most 2^-23 of a float.
    FourFloats &low = result.box.low, &high = result.box.high;
    low -= most(low, -low) * 0x1p-23F;
    high += most(high, -high) * 0x1p-23F;
    low[3] = static_cast<float>(triangle & 0xFFFFFFU);
    high[3] = static_cast<float>(triangle >> 24);
    return result;
}

}  // namespace

class TreeBuilder {
  public:
    using CornersOf = std::function<CellCorners(std::uint32_t)>;

    TreeBuilder(std::size_t triangles, const CornersOf& corners)
        : corners_(corners), triangles_(triangles) {
        parallelFor((triangles + kAtOnce - 1) / kAtOnce, [&](std::size_t part) {
            const std::size_t end = std::min(triangles, (part + 1) * kAtOnce);
            for (std::size_t i = part * kAtOnce; i < end; ++i) {
                const auto triangle = static_cast<std::uint32_t>(i);
                triangles_[i] = boxed(corners(triangle), triangle);
            }
        });
    }

    void build(TriangleTree& tree) {
        if (triangles_.empty()) return;
        Branch top;
        const std::span<BoxedTriangle> all(triangles_);
        task_size_ = std::max<std::size_t>(all.size() / kTasks, kLeastTask);
        top.root = add(partOf(all), 0, top);
        std::vector<Branch> branches(tasks_.size());
        task_size_ = 0;
        parallelFor(tasks_.size(), [&](std::size_t i) {
            const Task& task = tasks_[i];
            branches[i].root = add(task, task.depth, branches[i]);
        });
        tree.root_ = top.root;
        tree.nodes_ = std::move(top.nodes);
        tree.blocks_ = std::move(top.blocks);
        const std::size_t top_nodes = tree.nodes_.size();
        std::size_t nodes = top_nodes, blocks = tree.blocks_.size();
        for (const Branch& branch : branches) {
            nodes += branch.nodes.size();
            blocks += branch.blocks.size();
        }
        tree.nodes_.reserve(nodes);
        tree.blocks_.reserve(blocks);
        for (std::size_t i = 0; i < branches.size(); ++i) {
            const Child root = append(branches[i], tree);
            if (tree.root_ == kTask + i) tree.root_ = root;
            for (std::size_t n = 0; n < top_nodes; ++n)
                for (Child& child : tree.nodes_[n].child)
                    if (child == kTask + i) child = root;
        }
    }

  private:
    using Child = TriangleTree::Child;
    using Node = TriangleTree::Node;
    using Block = TriangleBlock;
    static constexpr std::size_t kWidth = TriangleTree::kWidth, kAtOnce = 4096;
    static constexpr std::size_t kTasks = 64, kLeastTask = 4096, kBins = 16, kFew = 64;
    /// From this depth on, ranges are halved, so that the depth is bounded.
    static constexpr int kMostDepth = 20;
    /// The child that the i-th task will build. No tree has as many nodes.
    static constexpr Child kTask = 0x40000000U;

    struct Branch {
        std::vector<Node> nodes;
        std::vector<Block> blocks;
        Child root = TriangleTree::kNone;
    };
    /// Triangles, their box, and that of their middles.
    struct Part {
        std::span<BoxedTriangle> range;
        LaneBox box{}, middles{};
    };
    struct Task : Part {
        int depth = 0;
    };
    struct Bin {
        LaneBox box;
        std::size_t count = 0;

        void add(const Bin& other) {
            box.add(other.box);
            count += other.count;
        }
        float cost() const { return box.area() * static_cast<float>(count); }
    };

    static Part partOf(std::span<BoxedTriangle> range) {
        Part part{range};
        for (const BoxedTriangle& triangle : range) {
            const FourFloats middle = triangle.middle();
            part.box.add(triangle.box);
            part.middles.add({middle, middle});
        }
        return part;
    }
    static Child append(Branch& branch, TriangleTree& tree);
    static std::array<Part, 2> split(const Part& part, bool halve);
    Child add(const Part& part, int depth, Branch& branch);
    Child addBlock(std::span<const BoxedTriangle> range, Branch& branch) const;

    const CornersOf& corners_;
    std::vector<BoxedTriangle> triangles_;
    std::size_t task_size_ = 0;  ///< larger ranges are split before the tasks begin
    std::vector<Task> tasks_;
};

/// Appends a branch to the tree. Returns its root there.
TriangleTree::Child TreeBuilder::append(Branch& branch, TriangleTree& tree) {
    const auto nodes = static_cast<Child>(tree.nodes_.size());
    const auto blocks = static_cast<Child>(tree.blocks_.size() * kWidth);
    const auto moved = [&](Child child) {
        if (child == TriangleTree::kNone) return child;
        return child + ((child & TriangleTree::kBlock) != 0 ? blocks : nodes);
    };
    for (Node& node : branch.nodes)
        for (Child& child : node.child)
            child = moved(child);
    tree.nodes_.insert(tree.nodes_.end(), branch.nodes.begin(), branch.nodes.end());
    tree.blocks_.insert(tree.blocks_.end(), branch.blocks.begin(), branch.blocks.end());
    const Child root = moved(branch.root);
    branch = {};
    return root;
}

/// Splits a range of at least two triangles where the heuristic is least, or in halves.
std::array<TreeBuilder::Part, 2> TreeBuilder::split(const Part& part, bool halve) {
    const std::span<BoxedTriangle> range = part.range;
    const FourFloats extent = part.middles.high - part.middles.low;
    const std::size_t count = range.size() < kFew ? kBins / 2 : kBins;
    const FourFloats scale =
        extent > 0x1p-100F ? static_cast<float>(count) * 0.999F / extent : FourFloats{};
    const auto bins_of = [&](const BoxedTriangle& triangle) {
        const FourFloats place = (triangle.middle() - part.middles.low) * scale;
        return __builtin_convertvector(place, FourInts);
    };
    float best = kEndless;
    std::size_t best_axis = 0;
    int best_bin = 0;
    if (!halve) {
        std::array<std::array<Bin, kBins>, 3> bins;
        for (const BoxedTriangle& triangle : range) {
            const FourInts places = bins_of(triangle);
            for (std::size_t axis = 0; axis < 3; ++axis)
                bins[axis][static_cast<std::size_t>(places[axis])].add({triangle.box, 1});
        }
        for (std::size_t axis = 0; axis < 3; ++axis) {
            std::array<float, kBins> right{};
            Bin sum;
            for (std::size_t i = count; i-- > 1;) {
                sum.add(bins[axis][i]);
                right[i] = sum.cost();
            }
            sum = {};
            for (std::size_t i = 1; i < count; ++i) {
                sum.add(bins[axis][i - 1]);
                const float cost = sum.cost() + right[i];
                if (sum.count == 0 || sum.count == range.size() || cost >= best) continue;
                best = cost;
                best_axis = axis;
                best_bin = static_cast<int>(i);
            }
        }
    }
    std::size_t size = range.size() / 2;
    if (best < kEndless) {
        const auto middle = std::partition(
            range.begin(), range.end(),
            [&](const BoxedTriangle& triangle) { return bins_of(triangle)[best_axis] < best_bin; });
        size = static_cast<std::size_t>(middle - range.begin());
    }
    return {partOf(range.first(size)), partOf(range.subspan(size))};
}

TriangleTree::Child TreeBuilder::addBlock(std::span<const BoxedTriangle> range,
                                          Branch& branch) const {
    Block& block = branch.blocks.emplace_back();
    for (std::size_t lane = 0; lane < kWidth; ++lane) {
        const std::uint32_t triangle = range[std::min(lane, range.size() - 1)].triangle();
        const CellCorners corners = corners_(triangle);
        block.triangle[lane] = triangle;
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const FourFloats at = inUnits(corners[corner]);
            for (std::size_t axis = 0; axis < 3; ++axis)
                block.corner[corner][axis][lane] = at[axis];
        }
    }
    return TriangleTree::kBlock + static_cast<Child>((branch.blocks.size() - 1) * kWidth) +
           static_cast<Child>(range.size() - 1);
}

TriangleTree::Child TreeBuilder::add(const Part& part, int depth, Branch& branch) {
    if (part.range.size() <= kWidth) return addBlock(part.range, branch);
    if (part.range.size() <= task_size_) {
        tasks_.push_back({part, depth});
        return kTask + static_cast<Child>(tasks_.size() - 1);
    }
    std::array<Part, kWidth> parts{part};
    std::size_t count = 1;
    while (count < kWidth) {
        std::size_t largest = kWidth;
        for (std::size_t i = 0; i < count; ++i) {
            if (parts[i].range.size() <= kWidth) continue;
            if (largest == kWidth || parts[i].box.area() > parts[largest].box.area()) largest = i;
        }
        if (largest == kWidth) break;
        const auto [first, second] = split(parts[largest], depth >= kMostDepth);
        parts[largest] = first;
        parts[count++] = second;
    }
    const std::size_t at = branch.nodes.size();
    branch.nodes.emplace_back();
    for (std::size_t i = 0; i < kWidth; ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            branch.nodes[at].plane[0][axis][i] = parts[i].box.low[axis];
            branch.nodes[at].plane[1][axis][i] = parts[i].box.high[axis];
        }
        const Child child = i < count ? add(parts[i], depth + 1, branch) : TriangleTree::kNone;
        branch.nodes[at].child[i] = child;
    }
    return Child(at);
}

TriangleTree::TriangleTree(std::size_t triangles,
                           const std::function<CellCorners(std::uint32_t)>& corners) {
    TreeBuilder(triangles, corners).build(*this);
}

namespace {

/// A ray in single precision. It begins at a point of the exact ray that is not behind the scene's
/// box. The point's coordinates are between origin_near and origin_far.
struct FloatRay {
    bool misses = false;  ///< whether the ray misses the scene's box
    std::array<float, 3> origin_near{}, origin_far{}, inverse{};
    std::array<std::uint8_t, 3> down{};  ///< 1 if the direction's component is negative
    std::array<std::uint8_t, 3> axis{};  ///< the last is the axis of the largest component
    std::array<float, 3> origin{};       ///< by place in `axis`
    std::array<float, 2> shear{};        ///< direction along the other axes per unit of the last

    explicit FloatRay(const ExactRay& ray);
};

FloatRay::FloatRay(const ExactRay& ray) {
    std::array<double, 3> at{}, along{}, across{};
    constexpr double kBox = 1 + 0x1p-20;
    double enter = 0, leave = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < 3; ++i) {
        at[i] = static_cast<double>(ray.origin[i]) * kCellUnit;
        along[i] = static_cast<double>(ray.direction[i]) * 0x1p-52;
        down[i] = along[i] < 0 ? 1 : 0;
        across[i] = 1 / along[i];
        inverse[i] = static_cast<float>(across[i]);
        if (along[i] == 0) {
            misses = misses || std::abs(at[i]) > kBox;
            continue;
        }
        const double side = down[i] != 0 ? -kBox : kBox;
        enter = std::max(enter, (-side - at[i]) * across[i]);
        leave = std::min(leave, (side - at[i]) * across[i]);
    }
    misses = misses || enter > leave;
    // A ray that begins outside is moved to the scene's box. The error is less than 2^-41.
    const float error = enter > 0 ? 0x1p-40F : 0;
    for (std::size_t i = 0; i < 3; ++i) {
        at[i] += enter * along[i];
        // More than the rounding of the origin, of the margin and of the sums.
        const float nearest = static_cast<float>(at[i]), sign = down[i] != 0 ? -1.0F : 1.0F;
        const float margin = sign * (std::abs(nearest) * 0x1p-22F + error);
        origin_near[i] = nearest + margin;
        origin_far[i] = nearest - margin;
    }
    axis = {1, 2, 0};
    if (std::abs(along[1]) > std::abs(along[axis[2]])) axis = {2, 0, 1};
    if (std::abs(along[2]) > std::abs(along[axis[2]])) axis = {0, 1, 2};
    for (std::size_t i = 0; i < 3; ++i)
        origin[i] = static_cast<float>(at[axis[i]]);
    for (std::size_t i = 0; i < 2; ++i)
        shear[i] = static_cast<float>(along[axis[i]] * across[axis[2]]);
}

PEELER_INLINE const EightFloats& lanesOf(const std::array<float, 8>& lanes) {
    return lanesAt(lanes.data());
}

/// A RayCone in single precision.
struct FloatCone {
    std::array<std::uint8_t, 3> axis{};
    std::array<float, 3> origin{};  ///< by place in `axis`
    std::array<float, 2> low{}, high{};
    float sign = 1;    ///< of the direction along the last axis
    float margin = 0;  ///< more than the error of a distance (README.md)

    explicit FloatCone(const RayCone& cone) : axis(cone.axis), sign(cone.backwards ? -1.0F : 1.0F) {
        double farthest = 1;
        for (std::size_t i = 0; i < 3; ++i) {
            const double at = static_cast<double>(cone.origin[axis[i]]) * kCellUnit;
            origin[i] = static_cast<float>(at);
            farthest = std::max(farthest, 1 + std::abs(at));
        }
        for (std::size_t i = 0; i < 2; ++i) {
            low[i] = static_cast<float>(cone.low[i]);
            high[i] = static_cast<float>(cone.high[i]);
        }
        margin = static_cast<float>(farthest * 0x1p-20 + 4 * cone.spread * kCellUnit);
    }
};

}  // namespace

/// Walks through the tree. Compiled for several processors.
struct TreeWalk {
    using Node = TriangleTree::Node;
    using Block = TriangleBlock;

    PEELER_INLINE static unsigned hitChildren(const Node& node, const FloatRay& ray) {
        // The relative error of `near` and `far` is less than 3.0001 · 2^-24 (README.md).
        constexpr float kMargin = 1 + 0x1p-21F;
        EightFloats near{}, far = near + kEndless;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::size_t down = ray.down[axis];
            // NaN (0 · infinity) leaves `near` and `far` as they are.
            raise(near,
                  (lanesOf(node.plane[down][axis]) - ray.origin_near[axis]) * ray.inverse[axis]);
            lower(far,
                  (lanesOf(node.plane[1 - down][axis]) - ray.origin_far[axis]) * ray.inverse[axis]);
        }
        return bitsOf(near <= far * kMargin);
    }

    PEELER_INLINE static void testBlock(const Block& block, unsigned lanes, const FloatRay& ray,
                                        std::vector<Candidate>& found) {
        // The corners' positions around the ray, sheared so that it is the last axis.
        const auto place = [&](std::size_t corner, EightFloats& x, EightFloats& y) {
            const auto& at = block.corner[corner];
            const EightFloats depth = lanesOf(at[ray.axis[2]]) - ray.origin[2];
            x = lanesOf(at[ray.axis[0]]) - ray.origin[0] - ray.shear[0] * depth;
            y = lanesOf(at[ray.axis[1]]) - ray.origin[1] - ray.shear[1] * depth;
        };
        EightFloats ax, ay, bx, by, cx, cy;
        place(0, ax, ay);
        place(1, bx, by);
        place(2, cx, cy);
        EightFloats size{};
        for (const EightFloats* value : {&ax, &ay, &bx, &by, &cx, &cy})
            size = size + (*value < 0 ? -*value : *value);
        // The error of an edge's determinant is less than `error` (README.md).
        const EightFloats error = size * 0x1p-19F + 0x1p-38F;
        const EightFloats p = ax * by - ay * bx, q = bx * cy - by * cx, r = cx * ay - cy * ax;
        EightFloats low = p, high = p;
        lower(low, q);
        lower(low, r);
        raise(high, q);
        raise(high, r);
        unsigned may = lanes & ~bitsOf((low < -error) & (high > error));
        if (may == 0) return;
        const unsigned inside = bitsOf((low > error) | (high < -error));
        for (; may != 0; may &= may - 1) {
            const int lane = std::countr_zero(may);
            found.push_back(
                {block.triangle[static_cast<std::size_t>(lane)], (inside >> lane & 1) != 0});
        }
    }

    PEELER_INLINE static unsigned hitChildren(const Node& node, const FloatCone& cone) {
        const std::size_t depth_axis = cone.axis[2];
        const EightFloats z0 = (lanesOf(node.plane[0][depth_axis]) - cone.origin[2]) * cone.sign,
                          z1 = (lanesOf(node.plane[1][depth_axis]) - cone.origin[2]) * cone.sign;
        const EightFloats& nearest = cone.sign > 0 ? z0 : z1;
        const EightFloats& farthest = cone.sign > 0 ? z1 : z0;
        EightInts out = farthest < -cone.margin;
        for (std::size_t i = 0; i < 2; ++i) {
            const EightFloats x0 = lanesOf(node.plane[0][cone.axis[i]]) - cone.origin[i],
                              x1 = lanesOf(node.plane[1][cone.axis[i]]) - cone.origin[i];
            const float low = cone.low[i], high = cone.high[i];
            out |= x0 - high * (high > 0 ? farthest : nearest) > cone.margin;
            out |= x1 - low * (low > 0 ? nearest : farthest) < -cone.margin;
        }
        return bitsOf(out) ^ 0xFFU;
    }

    PEELER_INLINE static unsigned hitTriangles(const Block& block, const FloatCone& cone) {
        EightInts behind = ~EightInts{}, left[2] = {behind, behind}, right[2] = {behind, behind};
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const auto& at = block.corner[corner];
            const EightFloats z = (lanesOf(at[cone.axis[2]]) - cone.origin[2]) * cone.sign;
            behind &= z < -cone.margin;
            for (std::size_t i = 0; i < 2; ++i) {
                const EightFloats x = lanesOf(at[cone.axis[i]]) - cone.origin[i];
                left[i] &= x - cone.low[i] * z < -cone.margin;
                right[i] &= x - cone.high[i] * z > cone.margin;
            }
        }
        return bitsOf(behind | left[0] | left[1] | right[0] | right[1]) ^ 0xFFU;
    }

    PEELER_INLINE static bool walk(const TriangleTree& tree, const RayCone& exact, std::size_t most,
                                   std::vector<BlockPart>& found) {
        found.clear();
        const FloatCone cone(exact);
        std::array<TriangleTree::Child, 256> stack;
        std::size_t size = 0;
        stack[size++] = tree.root_;
        while (size > 0) {
            const TriangleTree::Child at = stack[--size];
            if (at == TriangleTree::kNone) continue;
            if ((at & TriangleTree::kBlock) != 0) {
                const std::size_t place = at & ~TriangleTree::kBlock;
                const Block& block = tree.blocks_[place / 8];
                const unsigned lanes = 0xFFU >> (7 - place % 8) & hitTriangles(block, cone);
                if (lanes == 0) continue;
                if (found.size() == most) return false;
                found.push_back({&block, lanes});
                continue;
            }
            const Node& node = tree.nodes_[at];
            for (unsigned hit = hitChildren(node, cone); hit != 0; hit &= hit - 1)
                stack[size++] = node.child[static_cast<std::size_t>(std::countr_zero(hit))];
        }
        return true;
    }

    PEELER_INLINE static void walk(const TriangleTree& tree, const ExactRay& exact,
                                   std::vector<Candidate>& found) {
        found.clear();
        const FloatRay ray(exact);
        if (ray.misses || tree.root_ == TriangleTree::kNone) return;
        // A level adds at most seven entries (TreeBuilder::kMostDepth).
        std::array<TriangleTree::Child, 256> stack;
        std::size_t size = 0;
        stack[size++] = tree.root_;
        while (size > 0) {
            const TriangleTree::Child at = stack[--size];
            if ((at & TriangleTree::kBlock) != 0) {
                const std::size_t place = at & ~TriangleTree::kBlock;
                const unsigned lanes = 0xFFU >> (7 - place % 8);
                testBlock(tree.blocks_[place / 8], lanes, ray, found);
                continue;
            }
            const Node& node = tree.nodes_[at];
            for (unsigned hit = hitChildren(node, ray); hit != 0; hit &= hit - 1)
                stack[size++] = node.child[static_cast<std::size_t>(std::countr_zero(hit))];
        }
    }

#ifdef __x86_64__
    [[gnu::target("avx2")]] static void walkOnAvx2(const TriangleTree& tree, const ExactRay& ray,
                                                   std::vector<Candidate>& found) {
        walk(tree, ray, found);
    }
    [[gnu::target("avx2")]] static bool walkOnAvx2(const TriangleTree& tree, const RayCone& cone,
                                                   std::size_t most,
                                                   std::vector<BlockPart>& found) {
        return walk(tree, cone, most, found);
    }
#endif
};

void TriangleTree::candidates(const ExactRay& ray, std::vector<Candidate>& found) const {
#ifdef __x86_64__
    if (hasAvx2()) return TreeWalk::walkOnAvx2(*this, ray, found);
#endif
    TreeWalk::walk(*this, ray, found);
}

bool TriangleTree::candidates(const RayCone& cone, std::size_t most,
                              std::vector<BlockPart>& found) const {
#ifdef __x86_64__
    if (hasAvx2()) return TreeWalk::walkOnAvx2(*this, cone, most, found);
#endif
    return TreeWalk::walk(*this, cone, most, found);
}

}  // namespace peeler
