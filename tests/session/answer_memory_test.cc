#include "server/session/answer_memory.h"

#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"

namespace dynmesh::testing {
namespace {

TEST(AnswerMemoryTest, TheLastAnswersAreRemembered) {
  AnswerMemory<int> memory;
  for (size_t i = 0; i < kRememberedAnswers + 10; ++i) {
    memory.Remember(absl::StrCat(i), i, std::make_shared<const int>(i), 1);
  }
  EXPECT_EQ(*memory.Find("9", 9), nullptr);
  EXPECT_EQ(**memory.Find("10", 10), 10);
  EXPECT_FALSE(memory.Find("10", 11).ok()) << "another request";
}

TEST(AnswerMemoryTest, AnIdThatIsUsedAgainTakesThePlaceOfTheFirst) {
  AnswerMemory<int> memory;
  for (int round = 0; round < 3; ++round) {
    for (size_t i = 0; i < kRememberedAnswers; ++i) {
      memory.Remember(absl::StrCat(i % 100), round, std::make_shared<const int>(round),
                      kRememberedAnswerBytes / 200);
    }
  }
  for (size_t i = 0; i < 2 * kRememberedAnswers; ++i) {
    memory.Remember(absl::StrCat("new ", i), i, std::make_shared<const int>(i), 1);
  }
  EXPECT_EQ(*memory.Find("99", 2), nullptr);
  EXPECT_NE(*memory.Find(absl::StrCat("new ", 2 * kRememberedAnswers - 1), 2 * kRememberedAnswers - 1),
            nullptr);
}

}  // namespace
}  // namespace dynmesh::testing
