#include "server/rpc/backups_service.h"

#include "dynmesh/v1/backups.grpc.pb.h"
#include "server/rpc/backup_reactor.h"
#include "server/rpc/restore_reactor.h"

namespace dynmesh {
namespace {

class BackupsService final : public v1::BackupService::CallbackService {
 public:
  explicit BackupsService(const ServiceContext& services) : services_(services) {}

  grpc::ServerWriteReactor<v1::BackupSessionResponse>* BackupSession(
      grpc::CallbackServerContext* context, const v1::BackupSessionRequest* request) override {
    return (new BackupReactor(services_, context, *request))->Start();
  }

  grpc::ServerReadReactor<v1::RestoreBackupRequest>* RestoreBackup(
      grpc::CallbackServerContext* context, v1::RestoreBackupResponse* response) override {
    return (new RestoreReactor(services_, context, response))->Start();
  }

 private:
  const ServiceContext services_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeBackupsService(const ServiceContext& context) {
  return std::make_unique<BackupsService>(context);
}

}  // namespace dynmesh
