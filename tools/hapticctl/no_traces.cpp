// TO BE REMOVED when drivers/trace has its library.
#include "drivers/trace/trace_reader.h"
#include "drivers/trace/trace_recovery.h"

namespace hapticd::drivers {

config::Result<TraceInfo> readTrace(const std::filesystem::path& file, const TraceVisitor&) {
  return std::unexpected(config::Error{file.string(), "this build cannot read traces", ""});
}

config::Result<RecoveredTrace> recoverTrace(const std::filesystem::path& file,
                                            const std::function<void(double)>&) {
  return std::unexpected(config::Error{file.string(), "this build cannot read traces", ""});
}

}  // namespace hapticd::drivers
