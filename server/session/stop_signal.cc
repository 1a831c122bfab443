#include "server/session/stop_signal.h"

namespace dynmesh {
namespace {

class NeverStops final : public StopSignal {
 public:
  absl::Status Check() const override { return absl::OkStatus(); }
};

}  // namespace

const StopSignal& StopSignal::Never() {
  static const NeverStops never;
  return never;
}

}  // namespace dynmesh
