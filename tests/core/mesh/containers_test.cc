// The building blocks of a mesh against the standard containers.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>
#include <vector>

#include "core/mesh/bit_set.h"
#include "core/mesh/erase_ascending.h"
#include "core/mesh/incidence_lists.h"
#include "core/mesh/pipeline.h"
#include "core/mesh/slots.h"
#include "core/mesh/stamps.h"

namespace dynmesh {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(BitSetTest, BehavesLikeASortedSet) {
  std::mt19937 rng(1);
  BitSet bits;
  std::set<Slot> model;
  for (int i = 0; i < 20000; ++i) {
    const Slot slot = rng() % 300 * (rng() % 3 == 0 ? 997 : 1);
    const bool member = rng() % 2;
    bits.Assign(slot, member);
    member ? (void)model.insert(slot) : (void)model.erase(slot);
    const Slot from = rng() % 300000;
    const Slot first = rng() % 300, last = first + rng() % 150;
    const auto next = model.lower_bound(from);
    size_t present = 0;
    for (Slot s = first; s < last; ++s) present += model.count(s);
    ASSERT_EQ(bits.TestAll(first, last), present == last - first);
    ASSERT_EQ(bits.Next(from), next == model.end() ? kNoSlot : *next);
    ASSERT_EQ(bits.Test(slot), member);
    ASSERT_EQ(bits.size(), model.size());
  }
  std::vector<Slot> listed;
  bits.ForEach([&](Slot slot) { listed.push_back(slot); });
  EXPECT_EQ(listed, std::vector<Slot>(model.begin(), model.end()));
}

TEST(BitSetTest, ListsAndCollectsItsMembersWhateverTheirDensity) {
  std::mt19937 rng(5);
  for (int one_in : {1, 2, 9, 300, 20000}) {
    BitSet set;
    std::vector<Slot> expected;
    for (Slot slot = 0; slot < 50000; ++slot) {
      if (rng() % one_in != 0) continue;
      set.Set(slot);
      expected.push_back(slot);
    }
    std::vector<Slot> members = {7};
    std::vector<Slot> of_runs;
    set.ForEachRun([&](Slot begin, Slot end) {
      for (; begin < end; ++begin) of_runs.push_back(begin);
    });
    set.ListMembers(members);
    EXPECT_EQ(members, expected) << "one in " << one_in;
    EXPECT_EQ(of_runs, expected) << "one in " << one_in;
    for (size_t step : {1u, 63u, 64u, 65u, 1000u}) {
      std::vector<Slot> collected;
      std::vector<Slot> part(step);
      for (Slot next = 0; const size_t count = set.Collect(next, part.data(), step);
           next = part[count - 1] + 1) {
        collected.insert(collected.end(), part.begin(), part.begin() + count);
      }
      ASSERT_EQ(collected, expected) << "one in " << one_in << " step " << step;
    }
  }
}

TEST(BitSetTest, FillMakesTheFirstOnes) {
  for (Slot count : {0u, 1u, 63u, 64u, 65u, 4096u, 5000u}) {
    BitSet set;
    set.Fill(count);
    EXPECT_EQ(set.size(), count);
    EXPECT_EQ(set.Next(count), kNoSlot);
    EXPECT_EQ(set.Next(0), count == 0 ? kNoSlot : 0);
    set.Set(count);
    EXPECT_EQ(set.Next(count), count);
  }
}

TEST(SlotsTest, LowestFreeSlotIsReusedOnlyAfterQuarantine) {
  Slots slots;
  for (Slot expected = 0; expected < 4; ++expected) EXPECT_EQ(slots.Allocate(1).slot, expected);
  slots.Free(2);
  slots.Free(1);
  EXPECT_EQ(slots.Allocate(2).slot, 4u);
  slots.EndQuarantine();
  const Slots::Allocation reused = slots.Allocate(3);
  EXPECT_EQ(reused.slot, 1u);
  EXPECT_EQ(reused.born_before, 1u);
  EXPECT_EQ(slots.Allocate(3).slot, 2u);
  EXPECT_EQ(slots.Allocate(3).slot, 5u);
  EXPECT_EQ(slots.Born(1), 3u);
  EXPECT_EQ(slots.Born(77), 0u);
}

TEST(SlotsTest, UndoInReverseOrderRestoresTheLimitAndFreeSlots) {
  Slots slots;
  for (int i = 0; i < 3; ++i) slots.Allocate(1);
  slots.Free(0);
  slots.EndQuarantine();
  const auto reused = slots.Allocate(2);
  const auto appended = slots.Allocate(2);
  slots.Free(2);
  slots.UndoFree(2);
  slots.UndoAllocate(appended.slot, appended.born_before);
  slots.UndoAllocate(reused.slot, reused.born_before);
  EXPECT_EQ(slots.limit(), 3u);
  EXPECT_EQ(slots.num_live(), 2u);
  EXPECT_FALSE(slots.IsLive(0));
  EXPECT_EQ(slots.Born(0), 1u);
  EXPECT_EQ(slots.Allocate(5).slot, 0u);
}

TEST(SlotsTest, RoomCountsFreeSlotsAndTheLimit) {
  Slots slots;
  for (int i = 0; i < 3; ++i) slots.Allocate(1);
  EXPECT_TRUE(slots.CanAllocate(2, 5));
  EXPECT_FALSE(slots.CanAllocate(3, 5));
  slots.Free(1);
  EXPECT_FALSE(slots.CanAllocate(3, 5)) << "a quarantined slot is no room";
  slots.EndQuarantine();
  EXPECT_TRUE(slots.CanAllocate(3, 5));
}

TEST(SlotsTest, SlotsThatArePutAreAsTheyWereAndDeadOnesAreFree) {
  Slots slots;
  slots.PutLive(5, 7);
  slots.PutDead(0, 3);
  for (Slot slot : {1, 2, 3, 4}) slots.PutLive(slot, 2);
  slots.PutDead(3, 9);
  slots.FreeDead();
  EXPECT_TRUE(slots.IsSound());
  EXPECT_EQ(slots.limit(), 6u);
  EXPECT_EQ(slots.num_live(), 4u);
  EXPECT_EQ(slots.Born(5), 7u);
  EXPECT_EQ(slots.Born(3), 9u);
  EXPECT_EQ(slots.Allocate(10).slot, 0u);
  EXPECT_EQ(slots.Allocate(10).slot, 3u);
  EXPECT_EQ(slots.Allocate(10).slot, 6u);
}

TEST(StampColumnTest, ForEachSinceFindsWhatABruteForceScanFinds) {
  std::mt19937 rng(2);
  StampColumn column;
  std::map<Slot, Stamp> model;
  for (Stamp stamp = 1; stamp < 400; ++stamp) {
    const Slot slot = rng() % 5000;
    column.Touch(slot, stamp);
    model[slot] = stamp;
    const Stamp since = rng() % (stamp + 1);
    const Slot begin = rng() % 5000;
    const Slot end = begin + rng() % 3000;
    std::vector<Slot> expected, actual;
    for (const auto& [s, value] : model) {
      if (value > since && s >= begin && s < end) expected.push_back(s);
    }
    column.ForEachSince(since, begin, end, [&](Slot s) { actual.push_back(s); });
    ASSERT_EQ(actual, expected);
    ASSERT_GE(column.BoundSince(since), actual.size());
  }
}

class IncidenceListsTest : public ::testing::Test {
 protected:
  std::vector<Slot> Sorted(Slot lower) const {
    std::vector<Slot> entries;
    for (EdgeId e : lists_.Of(lower)) entries.push_back(e.slot());
    std::sort(entries.begin(), entries.end());
    return entries;
  }
  IncidenceLists<EdgeId> lists_;
};

TEST_F(IncidenceListsTest, BehavesLikeMultisets) {
  std::mt19937 rng(3);
  std::map<Slot, std::multiset<Slot>> model;
  for (int i = 0; i < 60000; ++i) {
    const Slot lower = rng() % 7;
    auto& expected = model[lower];
    const bool add = expected.empty() || rng() % 1000 < (i / 10000 % 2 == 0 ? 700u : 250u);
    if (add) {
      const Slot upper = rng() % 3 == 0 ? rng() % 5 : rng() % 100000;
      lists_.Add(lower, EdgeId(upper));
      expected.insert(upper);
    } else {
      const auto it = std::next(expected.begin(), rng() % std::min<size_t>(expected.size(), 50));
      lists_.Remove(lower, EdgeId(*it));
      expected.erase(it);
    }
    ASSERT_EQ(lists_.Length(lower), expected.size());
    if (expected.size() <= IncidenceLists<EdgeId>::kIndexedLength) {
      const auto entries = lists_.Of(lower);
      ASSERT_TRUE(std::is_sorted(entries.begin(), entries.end())) << i;
    }
    if (i % 97 == 0) {
      ASSERT_EQ(Sorted(lower), std::vector<Slot>(expected.begin(), expected.end()));
    }
  }
}

TEST_F(IncidenceListsTest, EmptiedListsGiveTheirRoomToOthers) {
  for (Slot upper = 0; upper < 10000; ++upper) lists_.Add(0, EdgeId(upper));
  const size_t bytes = lists_.memory_bytes();
  for (Slot upper = 0; upper < 10000; ++upper) lists_.Remove(0, EdgeId(upper));
  EXPECT_THAT(lists_.Of(0), IsEmpty());
  for (Slot upper = 0; upper < 10000; ++upper) lists_.Add(1, EdgeId(upper));
  EXPECT_LE(lists_.memory_bytes(), bytes + 4096);
}

TEST_F(IncidenceListsTest, OneEntryTwiceIsRemovedOnceAtATime) {
  lists_.Add(3, EdgeId(9));
  lists_.Add(3, EdgeId(9));
  lists_.Remove(3, EdgeId(9));
  EXPECT_THAT(lists_.Of(3), ElementsAre(EdgeId(9)));
  EXPECT_THAT(lists_.Of(99), IsEmpty());
}

TEST(BitSetTest, ARangeIsWholeOnlyWithoutAGap) {
  for (Slot begin : {0u, 1u, 63u, 64u, 100u}) {
    for (Slot end : {begin, begin + 1, begin + 63, begin + 64, begin + 129}) {
      BitSet set;
      for (Slot slot = begin; slot < end; ++slot) set.Set(slot);
      EXPECT_TRUE(set.TestAll(begin, end));
      EXPECT_FALSE(set.TestAll(begin, end + 1));
      for (Slot gap = begin; gap < end; ++gap) {
        set.Clear(gap);
        EXPECT_FALSE(set.TestAll(begin, end));
        set.Set(gap);
      }
    }
  }
}

TEST(StampColumnTest, SaysWhetherAllOfAPageChanged) {
  StampColumn stamps;
  for (Slot slot = 0; slot < 600; ++slot) stamps.Touch(slot, 3);
  EXPECT_TRUE(stamps.AreAllSince(2, 0, 512));
  EXPECT_FALSE(stamps.AreAllSince(3, 0, 512));
  EXPECT_TRUE(stamps.AreAllSince(2, 512, 600));
  EXPECT_FALSE(stamps.AreAllSince(0, 512, 601));
  EXPECT_FALSE(stamps.AreAllSince(0, 1024, 1025));
  stamps.Touch(100, 5);
  EXPECT_FALSE(stamps.AreAllSince(3, 0, 512));
  EXPECT_TRUE(stamps.AreAllSince(3, 100, 101));
}

TEST(EraseAscendingTest, RemovesOneEntryAndLeavesWhatStandsBehind) {
  std::mt19937 rng(11);
  for (size_t length = 1; length <= 40; ++length) {
    for (int round = 0; round < 50; ++round) {
      std::vector<Slot> list(length + kListMargin);
      for (Slot& slot : list) slot = rng() % (2 * length);  // some entries are equal
      std::sort(list.begin(), list.begin() + length);
      const Slot value = list[rng() % length];
      std::vector<Slot> expected = list;
      std::move(std::find(expected.begin(), expected.end(), value) + 1, expected.begin() + length,
                std::find(expected.begin(), expected.end(), value));
      EraseAscending(list.data(), length, value);
      expected[length - 1] = list[length - 1];  // no longer of the list
      ASSERT_EQ(list, expected) << length << " entries, removed " << value;
    }
  }
}

TEST(PipelineTest, RunsEveryStageOfEveryItemInOrderAndAheadOfTheNextStage) {
  for (size_t count : {0u, 1u, 5u, 6u, 100u}) {
    std::vector<size_t> done(3);
    const auto stage = [&](size_t s) {
      return [&done, s](size_t i) {
        EXPECT_EQ(i, done[s]++);
        if (s > 0) {
          EXPECT_GT(done[s - 1], i);
        }
      };
    };
    Pipeline(count, stage(0), stage(1), stage(2));
    EXPECT_THAT(done, ElementsAre(count, count, count));
  }
}

}  // namespace
}  // namespace dynmesh
