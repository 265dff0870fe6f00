#include "tools/hapticbench/gnuplot.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <system_error>

namespace hapticd::tools {
namespace {

bool succeeds(const std::filesystem::path& script) {
  std::string program = "gnuplot", file = script.string();
  char* arguments[] = {program.data(), file.data(), nullptr};
  pid_t child = 0;
  int status = 0;
  return posix_spawnp(&child, "gnuplot", nullptr, nullptr, arguments, environ) == 0 &&
         waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace

std::string gnuplotQuoted(const std::string& text) {
  std::string quoted;
  for (const char c : text) quoted += c == '\'' ? std::string("''") : std::string(1, c);
  return quoted;
}

config::Result<void> runGnuplot(const std::string& script, const std::filesystem::path& image,
                                const std::string& remedy) {
  const std::filesystem::path file = image.string() + ".gnuplot";
  std::ofstream(file) << script;
  const bool plotted = succeeds(file);
  std::error_code ignored;
  std::filesystem::remove(file, ignored);
  if (plotted && std::filesystem::exists(image)) return {};
  return std::unexpected(config::Error{image.string(), "cannot be plotted",
                                       "is gnuplot installed and the folder writable? " + remedy});
}

}  // namespace hapticd::tools
