// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/commands.h"

#include "tools/hapticctl/text/error_text.h"

namespace hapticd::tools {
namespace {

/// Adds an explanation, because the daemon only reports that it refuses this user.
ClientError explained(ClientError error) {
  if (error.what == "org.varlink.service.PermissionDenied") {
    error.remedy =
        "no permission to see the depth image\n"
        "members of the group haptic-view may: 'sudo usermod -aG haptic-view $USER', then log in again; or "
        "set "
        "control.depth_for_everyone in hapticd's configuration file";
  }
  return error;
}

}  // namespace

std::expected<Snapshot, int> fetchSnapshot(const CommandOptions& options) {
  const auto failed = [&](const auto& error) { return std::unexpected(report(error, options.json)); };
  auto client = connectTo(options, false);
  if (!client) return failed(client.error());
  const auto subscribed = client->subscribe("io.hapticd.Status.GetSnapshot", Json::object());
  if (!subscribed) return failed(subscribed.error());
  SnapshotAssembler assembler;
  do {
    const auto reply = client->next(VarlinkClient::kTimeLimit);
    if (!reply) return failed(explained(reply.error()));
    if (const auto good = assembler.add(*reply); !good) return failed(good.error());
  } while (client->promisesMore());
  auto snapshot = assembler.finish();
  if (!snapshot) return failed(snapshot.error());
  return std::move(*snapshot);
}

}  // namespace hapticd::tools
