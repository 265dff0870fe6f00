#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>

#include "tools/manual/page.h"

namespace hapticd::tools {
namespace {

int fail(const config::Error& error, int status) {
  fmt::print(stderr, "manual-page: {}\n", error.text());
  return status;
}

int writePage(const std::string& template_file, const std::string& program, const std::string& out_file) {
  std::ifstream stream(template_file, std::ios::binary);
  if (!stream) return fail({template_file, "cannot be read", "check --template"}, EX_NOINPUT);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  const auto page = manualPage({text, program, HAPTICD_VERSION});
  if (!page) return fail(page.error(), EX_DATAERR);
  std::ofstream out(out_file, std::ios::binary);
  out << *page << std::flush;
  return out ? EX_OK : fail({out_file, "cannot be written", "check --out"}, EX_CANTCREAT);
}

int run(int argc, char** argv) {
  CLI::App app{"manual-page: fills the template of a manual page"};
  std::string template_file;
  std::string program;
  std::string out_file;
  app.add_option("--template", template_file, "the page with placeholders")->required()->type_name("FILE");
  app.add_option("--program", program, "the program that the page describes")->type_name("FILE");
  app.add_option("--out", out_file, "the finished page")->required()->type_name("FILE");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? EX_OK : EX_USAGE;
  }
  return writePage(template_file, program, out_file);
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::tools::run(argc, argv);
}
