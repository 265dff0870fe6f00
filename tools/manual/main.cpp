#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "tools/manual/page.h"

namespace hapticd::tools {
namespace {

int fail(const config::Error& error, int status) {
  fmt::print(stderr, "manual-page: {}\n", error.text());
  return status;
}

struct Arguments {
  std::string template_file;
  std::string program;
  std::vector<std::string> interface_files;
  std::string out_file;
};

std::optional<std::string> contentOf(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return std::nullopt;
  return std::string{std::istreambuf_iterator<char>(stream), {}};
}

int writePage(const Arguments& arguments) {
  const auto text = contentOf(arguments.template_file);
  if (!text) return fail({arguments.template_file, "cannot be read", "check --template"}, EX_NOINPUT);
  PageSource source{*text, arguments.program, HAPTICD_VERSION};
  for (const std::string& file : arguments.interface_files) {
    auto interface = contentOf(file);
    if (!interface) return fail({file, "cannot be read", "check --interface"}, EX_NOINPUT);
    source.interfaces.push_back(std::move(*interface));
  }
  const auto page = manualPage(source);
  if (!page) return fail(page.error(), EX_DATAERR);
  std::ofstream out(arguments.out_file, std::ios::binary);
  out << *page << std::flush;
  return out ? EX_OK : fail({arguments.out_file, "cannot be written", "check --out"}, EX_CANTCREAT);
}

int run(int argc, char** argv) {
  CLI::App app{"manual-page: fills the template of a manual page"};
  Arguments arguments;
  app.add_option("--template", arguments.template_file, "the page with placeholders")
      ->required()
      ->type_name("FILE");
  app.add_option("--program", arguments.program, "the program that the page describes")->type_name("FILE");
  app.add_option("--interface", arguments.interface_files, "a Varlink interface that the page describes")
      ->type_name("FILE");
  app.add_option("--out", arguments.out_file, "the finished page")->required()->type_name("FILE");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? EX_OK : EX_USAGE;
  }
  return writePage(arguments);
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::tools::run(argc, argv);
}
