#ifndef DYNMESH_SERVER_SESSION_FINGERPRINT_H_
#define DYNMESH_SERVER_SESSION_FINGERPRINT_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "core/edit/transaction.h"

struct XXH64_state_s;

namespace dynmesh {

/// A 64-bit hash (XXH64) of a sequence of values, to tell a retry from another request with the same id.
class Fingerprint {
 public:
  Fingerprint();
  ~Fingerprint();
  Fingerprint(const Fingerprint&) = delete;
  Fingerprint& operator=(const Fingerprint&) = delete;

  void AddBytes(const void* data, size_t size);
  void AddNumber(uint64_t number) { AddBytes(&number, sizeof(number)); }
  /// With its length, so that neighbouring strings cannot trade characters.
  void AddString(absl::string_view text);
  /// REQUIRES: T has no padding. With its length.
  template <typename T>
  void AddArray(const std::vector<T>& values) {
    AddNumber(values.size());
    AddBytes(values.data(), values.size() * sizeof(T));
  }
  void AddSpec(const AttributeSpec& spec);
  void AddEdit(const Edit& edit);

  uint64_t value() const;

 private:
  std::unique_ptr<XXH64_state_s, void (*)(XXH64_state_s*)> state_;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_FINGERPRINT_H_
