#include "drivers/trace/trace_head.h"

#include "drivers/trace/mcap_scanner.h"
#include "drivers/trace/messages.h"

namespace hapticd::drivers {

bool hasDepthChannel(const std::filesystem::path& trace) {
  auto scanner = mcap::Scanner::open(trace);
  if (!scanner) return false;
  for (auto record = scanner->next(); record; record = scanner->next()) {
    if (record->opcode == mcap::Opcode::chunk || record->opcode == mcap::Opcode::data_end) return false;
    if (record->opcode != mcap::Opcode::channel) continue;
    mcap::ByteReader reader(record->content);
    reader.number<std::uint16_t>();  // its id
    reader.number<std::uint16_t>();  // that of its schema
    if (reader.text() == kChannelName<DepthRecord>.topic) return true;
  }
  return false;
}

}  // namespace hapticd::drivers
