// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <functional>
#include <string>

#include "config/base/file_content.h"
#include "config/base/program.h"
#include "config/base/whole_file.h"
#include "tools/manual/generated.h"

namespace hapticd::tools {
namespace {

using Generator = std::function<base::Result<std::string>(std::string_view)>;

base::Result<void> generate(const std::string& file, const Generator& generator) {
  const auto text = base::fileContent(file, {.longest = 1024 * 1024});
  if (!text) return std::unexpected(base::Error{file, text.error().text(), "name the folder of the sources"});
  const auto made = generator(*text);
  if (!made) return std::unexpected(made.error());
  if (*made == *text) return {};
  fmt::print("{}\n", file);
  return base::writeWholeFile(file, *made, base::IfExists::replace);
}

int run(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "usage: generate-parts FOLDER    (of the sources; names the files that change)\n");
    return EX_USAGE;
  }
  const std::string folder = argv[1];
  base::Result<void> done = generate(folder + "/config/hapticd.yaml", withParameters);
  if (done) done = generate(folder + "/docs/fixtures.md", withMembers);
  for (const char* interface : {"Control", "Status"}) {
    if (done)
      done = generate(fmt::format("{}/daemon/control/io.hapticd.{}.varlink", folder, interface), withTypes);
  }
  if (done) return EX_OK;
  fmt::print(stderr, "generate-parts: {}\n", done.error().text());
  return EX_DATAERR;
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::base::runProgram("generate-parts", [&] { return hapticd::tools::run(argc, argv); });
}
