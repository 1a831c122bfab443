#include "core/spatial/box_tree.h"

#include <boost/geometry/algorithms/comparable_distance.hpp>
#include <boost/geometry/geometries/box.hpp>
#include <boost/geometry/geometries/point.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <boost/geometry/strategies/cartesian/distance_pythagoras_point_box.hpp>
#include <boost/iterator/transform_iterator.hpp>
#include <utility>

namespace dynmesh {
namespace {

namespace bg = boost::geometry;
namespace bgi = boost::geometry::index;

using BoostPoint = bg::model::point<float, 3, bg::cs::cartesian>;
using BoostBox = bg::model::box<BoostPoint>;

BoostPoint ToBoost(const std::array<float, 3>& p) { return BoostPoint(p[0], p[1], p[2]); }
BoostBox ToBoost(const FloatBox& box) { return BoostBox(ToBoost(box.low), ToBoost(box.high)); }

/// What the tree holds: an entry as Boost reads it.
struct Value {
  BoostBox box;
  Slot slot;

  explicit Value(const BoxTree::Entry& entry) : box(ToBoost(entry.box)), slot(entry.slot) {}

  BoxTree::Entry ToEntry() const {
    const BoostPoint &low = box.min_corner(), &high = box.max_corner();
    return {{{low.get<0>(), low.get<1>(), low.get<2>()}, {high.get<0>(), high.get<1>(), high.get<2>()}},
            slot};
  }
};

struct ToValue {
  Value operator()(const BoxTree::Entry& entry) const { return Value(entry); }
};

struct BoxOf {
  using result_type = const BoostBox&;
  result_type operator()(const Value& value) const { return value.box; }
};

/// Boost wants to be able to compare values; nothing is ever looked up by value.
struct SameSlot {
  bool operator()(const Value& a, const Value& b) const { return a.slot == b.slot; }
};

/// std::allocator, which adds up what is allocated: the tree does not tell its size.
template <typename T>
class CountingAllocator {
 public:
  using value_type = T;

  explicit CountingAllocator(size_t* bytes) : bytes_(bytes) {}
  template <typename U>
  CountingAllocator(const CountingAllocator<U>& other) : bytes_(other.bytes()) {}  // NOLINT: as allocators do

  T* allocate(size_t n) {
    T* items = std::allocator<T>().allocate(n);
    *bytes_ += n * sizeof(T);
    return items;
  }
  void deallocate(T* items, size_t n) {
    *bytes_ -= n * sizeof(T);
    std::allocator<T>().deallocate(items, n);
  }
  size_t* bytes() const { return bytes_; }

  template <typename U>
  friend bool operator==(const CountingAllocator& a, const CountingAllocator<U>& b) {
    return a.bytes() == b.bytes();
  }
  template <typename U>
  friend bool operator!=(const CountingAllocator& a, const CountingAllocator<U>& b) {
    return a.bytes() != b.bytes();
  }

 private:
  size_t* bytes_;
};

// Nodes of run-time capacity: those of a capacity fixed at compile time are all as large as the largest kind
// of node, which takes half as much again.
constexpr size_t kNodeEntries = 16;
using Parameters = bgi::dynamic_quadratic;
using Tree = bgi::rtree<Value, Parameters, BoxOf, SameSlot, CountingAllocator<Value>>;

/// Thrown through Boost's traversal, which offers no other way to end it, and caught in this file.
struct Stopped {
  absl::Status status;
};

void ThrowUnlessOk(absl::Status status) {
  if (!status.ok()) throw Stopped{std::move(status)};
}

template <typename Predicates, typename Fn>
absl::Status Traverse(const Tree& tree, const Predicates& predicates, Fn fn) {
  struct Output {
    Fn* fn;
    Output& operator*() { return *this; }
    Output& operator++() { return *this; }
    Output& operator=(const Value& value) {
      (*fn)(value);
      return *this;
    }
  };
  try {
    tree.query(predicates, Output{&fn});
  } catch (const Stopped& stopped) {
    return stopped.status;
  }
  return absl::OkStatus();
}

}  // namespace

struct BoxTree::Impl {
  size_t bytes = 0;
  Tree tree;

  Impl() : tree(Parameters(kNodeEntries), BoxOf(), SameSlot(), CountingAllocator<Value>(&bytes)) {}
  template <typename Iterator>
  Impl(Iterator begin, Iterator end)
      : tree(begin, end, Parameters(kNodeEntries), BoxOf(), SameSlot(), CountingAllocator<Value>(&bytes)) {}
};

BoxTree::BoxTree() : impl_(std::make_unique<Impl>()) {}
BoxTree::BoxTree(BoxTree&&) noexcept = default;
BoxTree& BoxTree::operator=(BoxTree&&) noexcept = default;
BoxTree::~BoxTree() = default;

void BoxTree::Build(const std::vector<Entry>& entries) {
  impl_ = std::make_unique<Impl>();  // frees the old one before the new one takes memory
  impl_ = std::make_unique<Impl>(boost::make_transform_iterator(entries.begin(), ToValue()),
                                 boost::make_transform_iterator(entries.end(), ToValue()));
}

void BoxTree::Insert(const Entry& entry) { impl_->tree.insert(Value(entry)); }

size_t BoxTree::size() const { return impl_->tree.size(); }

size_t BoxTree::memory_bytes() const { return impl_->bytes; }

absl::Status BoxTree::ForEachMeeting(const FloatBox& box, WorkMeter& meter,
                                     absl::FunctionRef<absl::Status(const Entry&)> visit) const {
  const auto look = [&meter](const Value&) {
    ThrowUnlessOk(meter.ChargeSteps(1));
    return true;
  };
  return Traverse(impl_->tree, bgi::satisfies(look) && bgi::intersects(ToBoost(box)),
                  [&visit](const Value& value) { ThrowUnlessOk(visit(value.ToEntry())); });
}

absl::Status BoxTree::FindNearest(const NearestQuery& query, WorkMeter& meter,
                                  std::vector<Slot>& slots) const {
  const auto look = [&](const Value& value) {
    ThrowUnlessOk(meter.ChargeSteps(1));
    return query.accept(value.ToEntry());
  };
  slots.clear();
  const auto count = static_cast<unsigned>(query.count);
  return Traverse(impl_->tree, bgi::satisfies(look) && bgi::nearest(ToBoost(query.point), count),
                  [&slots](const Value& value) { slots.push_back(value.slot); });
}

}  // namespace dynmesh
