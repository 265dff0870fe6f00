#include "tools/hapticctl/fetch_snapshot.h"

#include "tools/hapticctl/error_text.h"

namespace hapticd::tools {

std::expected<Snapshot, int> fetchSnapshot(const CommandOptions& options) {
  const auto failed = [&](const auto& error) { return std::unexpected(report(error, options.json)); };
  auto client = connectTo(options, false);
  if (!client) return failed(client.error());
  const auto subscribed = client->subscribe("io.hapticd.Status.GetSnapshot", Json::object());
  if (!subscribed) return failed(subscribed.error());
  SnapshotAssembler assembler;
  do {
    const auto reply = client->next(VarlinkClient::kTimeLimit);
    if (!reply) return failed(reply.error());
    if (const auto good = assembler.add(*reply); !good) return failed(good.error());
  } while (client->promisesMore());
  auto snapshot = assembler.finish();
  if (!snapshot) return failed(snapshot.error());
  return std::move(*snapshot);
}

}  // namespace hapticd::tools
