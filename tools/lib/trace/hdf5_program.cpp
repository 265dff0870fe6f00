// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/trace/hdf5_program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/lib/child/child_process.h"

namespace hapticd::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr const char* kName = "haptic-hdf5";
constexpr const char* kRemedy = "install the package hapticd-tools, or write a .csv";

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

config::Result<fs::path> findProgram() {
  std::error_code unknown;
  const fs::path here = fs::read_symlink("/proc/self/exe", unknown).parent_path();
  for (const fs::path& folder : {here, here.parent_path() / "libexec/hapticd"}) {
    if (::access((folder / kName).c_str(), X_OK) == 0) return folder / kName;
  }
  return std::unexpected(
      config::Error{"HDF5", fmt::format("is written by {}, which is not installed", kName), kRemedy});
}

std::vector<std::string> commandFor(const fs::path& program, const fs::path& trace, const fs::path& hdf5,
                                    const TraceSelection& selection, IfExists if_exists) {
  std::vector<std::string> command{program, "--trace=" + trace.string(), "--out=" + hdf5.string(),
                                   fmt::format("--from={}", selection.from_s),
                                   fmt::format("--rows={}", selection.most_ticks)};
  if (!std::isinf(selection.to_s)) command.push_back(fmt::format("--to={}", selection.to_s));
  if (if_exists == IfExists::replace) command.emplace_back("--force");
  return command;
}

/// Reads a line of the program's output: {"share": 0..1}, {"rows": n} or {"error": {"where", "what",
/// "remedy"}}.
struct Answers {
  const Progress& progress;
  config::Result<std::uint64_t> result =
      std::unexpected(config::Error{kName, "ended without an answer", kRemedy});

  void take(const std::string& line) {
    const Json answer = Json::parse(line, nullptr, false);
    if (!answer.is_object()) return;
    if (answer.contains("share") && progress) progress(answer.value("share", 0.0));
    if (answer.contains("rows")) result = answer.value("rows", std::uint64_t{0});
    if (!answer.contains("error")) return;
    const Json& error = answer["error"];
    result = std::unexpected(
        config::Error{error.value("where", ""), error.value("what", ""), error.value("remedy", "")});
  }
};

/// Reads what the child prints until it closes its output.
void readLines(std::FILE* from, const std::function<void(const std::string&)>& take) {
  std::string line;
  for (int byte = std::fgetc(from); byte != EOF; byte = std::fgetc(from)) {
    if (byte != '\n') {
      line.push_back(static_cast<char>(byte));
      continue;
    }
    take(line);
    line.clear();
  }
}

}  // namespace

config::Result<std::uint64_t> exportHdf5ByProgram(const fs::path& trace, const fs::path& hdf5,
                                                  const TraceSelection& selection, const Progress& progress,
                                                  IfExists if_exists) {
  const auto program = findProgram();
  if (!program) return std::unexpected(program.error());
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
    return std::unexpected(config::Error{kName, std::strerror(errno), "raise the limit of open files"});
  }
  const File output(::fdopen(ends[0], "r"));
  auto child = ChildProcess::start(commandFor(*program, trace, hdf5, selection, if_exists),
                                   {.output = ends[1]}, kRemedy);
  ::close(ends[1]);
  if (!child) return std::unexpected(child.error());
  Answers answers{progress};
  readLines(output.get(), [&](const std::string& line) { answers.take(line); });
  return answers.result;
}

}  // namespace hapticd::tools
