// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>
#include <vector>

#include "config/base/file_content.h"
#include "config/base/program.h"
#include "config/base/whole_file.h"
#include "tools/manual/page.h"

namespace hapticd::tools {
namespace {

int fail(const base::Error& error, int status) {
  fmt::print(stderr, "manual-page: {}\n", error.text());
  return status;
}

struct Arguments {
  std::string template_file;
  std::string program;
  std::vector<std::string> interface_files;
  std::string out_file;
};

int writePage(const Arguments& arguments) {
  constexpr base::FileRequest kText{.longest = 1024 * 1024};
  const auto text = base::fileContent(arguments.template_file, kText);
  if (!text) return fail({arguments.template_file, text.error().text(), "check --template"}, EX_NOINPUT);
  PageSource source{*text, arguments.program, HAPTICD_VERSION};
  for (const std::string& file : arguments.interface_files) {
    auto interface = base::fileContent(file, kText);
    if (!interface) return fail({file, interface.error().text(), "check --interface"}, EX_NOINPUT);
    source.interfaces.push_back(std::move(*interface));
  }
  const auto page = manualPage(source);
  if (!page) return fail(page.error(), EX_DATAERR);
  const auto written = base::writeWholeFile(arguments.out_file, *page, base::IfExists::replace);
  return written ? EX_OK : fail(written.error(), EX_CANTCREAT);
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
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  return writePage(arguments);
}

}  // namespace
}  // namespace hapticd::tools

int main(int argc, char** argv) {
  return hapticd::base::runProgram("manual-page", [&] { return hapticd::tools::run(argc, argv); });
}
