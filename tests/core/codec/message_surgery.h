#ifndef DYNMESH_TESTS_CORE_CODEC_MESSAGE_SURGERY_H_
#define DYNMESH_TESTS_CORE_CODEC_MESSAGE_SURGERY_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"

/// What a hostile sender can do: change a message and seal it again, so that its checksum matches.
namespace dynmesh {

/// `message` with the checksum that its other bytes deserve.
std::string Reseal(std::string message);

/// A section as a sender writes it, true or not.
struct ForgedSection {
  uint32_t id = 0;
  uint8_t packing = 0;
  uint64_t count = 0;
  uint64_t size = 0;
  std::string bytes;  ///< as many as `size` says in an honest message
};

/// A message taken apart, and put together again without any check.
struct ForgedMessage {
  std::string header;
  std::vector<ForgedSection> sections;

  std::string Seal() const;
};

/// REQUIRES: `message` was written by EncodeDelta.
ForgedMessage TakeApart(absl::string_view message);

}  // namespace dynmesh

#endif  // DYNMESH_TESTS_CORE_CODEC_MESSAGE_SURGERY_H_
