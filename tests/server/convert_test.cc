// Values as messages.

#include "server/rpc/convert.h"

#include <gtest/gtest.h>

namespace dynmesh::testing {
namespace {

TEST(ConvertTest, ATimeIsOneOfProtobufBefore1970Too) {
  for (const absl::Duration since : {absl::ZeroDuration(), absl::Nanoseconds(1), absl::Milliseconds(1500),
                                     -absl::Nanoseconds(1), -absl::Milliseconds(1500), -absl::Seconds(2)}) {
    const auto message = FromTime(absl::UnixEpoch() + since);
    EXPECT_GE(message.nanos(), 0) << since;
    EXPECT_LT(message.nanos(), 1'000'000'000) << since;
    EXPECT_EQ(absl::Seconds(message.seconds()) + absl::Nanoseconds(message.nanos()), since);
  }
}

}  // namespace
}  // namespace dynmesh::testing
