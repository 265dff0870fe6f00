// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/plot/gnuplot.h"

#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string_view>

#include "config/base/descriptor.h"
#include "config/base/whole_file.h"

namespace hapticd::tools {
namespace {

/// A file in memory: gnuplot's own writes to a disk would fail silently.
class MemoryFile {
 public:
  MemoryFile() : descriptor_(::memfd_create("gnuplot", MFD_CLOEXEC)) {}
  int descriptor() const { return descriptor_.get(); }

  /// Fills it and goes back to its beginning.
  bool fill(std::string_view text) {
    while (!text.empty()) {
      const ssize_t count = ::write(descriptor(), text.data(), text.size());
      if (count < 0) return false;
      text.remove_prefix(static_cast<std::size_t>(count));
    }
    return ::lseek(descriptor(), 0, SEEK_SET) == 0;
  }

  std::string content() {
    std::string content;
    std::array<char, 1 << 16> part;
    ssize_t count = ::lseek(descriptor(), 0, SEEK_SET) == 0 ? 1 : 0;
    while (count > 0) {
      count = ::read(descriptor(), part.data(), part.size());
      if (count > 0) content.append(part.data(), static_cast<std::size_t>(count));
    }
    return content;
  }

 private:
  base::Descriptor descriptor_;
};

bool succeeds(const MemoryFile& script, const MemoryFile& image) {
  posix_spawn_file_actions_t streams;
  ::posix_spawn_file_actions_init(&streams);
  ::posix_spawn_file_actions_adddup2(&streams, script.descriptor(), STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&streams, image.descriptor(), STDOUT_FILENO);
  std::string program = "gnuplot", from_input = "-";
  char* arguments[] = {program.data(), from_input.data(), nullptr};
  pid_t child = 0;
  int status = 0;
  const bool started = ::posix_spawnp(&child, "gnuplot", &streams, nullptr, arguments, environ) == 0;
  ::posix_spawn_file_actions_destroy(&streams);
  while (started && ::waitpid(child, &status, 0) != child) {
    if (errno != EINTR) return false;
  }
  return started && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace

std::string gnuplotQuoted(const std::string& text) {
  std::string quoted;
  for (const char c : text) quoted += c == '\'' ? std::string("''") : std::string(1, c);
  return quoted;
}

const char* gnuplotTerminal(const std::filesystem::path& image) {
  const auto ends_in = [&image](std::string_view ending) {
    return base::checkEnding(image, std::array{ending}).has_value();
  };
  return ends_in(".png") ? "pngcairo" : ends_in(".pdf") ? "pdfcairo" : "svg";
}

base::Result<std::string> drawnByGnuplot(const std::string& script, const std::string& remedy) {
  MemoryFile text, image;
  if (text.fill(script) && succeeds(text, image)) {
    std::string content = image.content();
    if (!content.empty()) return content;
  }
  return std::unexpected(base::Error{"gnuplot", "draws nothing", "is gnuplot installed? " + remedy});
}

base::Result<void> runGnuplot(const std::string& script, const std::filesystem::path& image,
                              const std::string& remedy) {
  const auto drawn = drawnByGnuplot(script, remedy);
  if (!drawn) return std::unexpected(drawn.error());
  return base::writeWholeFile(image, *drawn, base::IfExists::replace);
}

}  // namespace hapticd::tools
