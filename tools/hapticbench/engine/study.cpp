// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/engine/study.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sysexits.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <optional>

#include "config/base/whole_file.h"
#include "tools/lib/options/option_checks.h"
#include "tools/lib/parts/parts.h"
#include "tools/lib/plot/gnuplot.h"

namespace hapticd::tools {

/// What the files are that a run reads and writes.
struct StudyCommand::Files {
  std::string json;
  std::string plot;
  Division division;
  std::optional<PartFile> joined;  ///< the run that --join put together
};

int fail(const base::Error& error, int status) {
  fmt::print(stderr, "hapticbench: {}\n", error.text());
  return status;
}

int writeReport(const std::string& file, const std::string& text) {
  if (file.empty()) return EX_OK;
  const auto written = base::writeWholeFile(file, text, base::IfExists::replace);
  return written ? EX_OK : fail(written.error(), EX_CANTCREAT);
}

void showProgress(const std::string& what) {
  if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r{:<70}\r", what);
}

StudyCommand::StudyCommand(CLI::App& app, const std::string& name, const std::string& description)
    : command_(app.add_subcommand(name, description)), files_(std::make_shared<Files>()) {
  command_->add_option("--json", files_->json, "also write the result there, for programs")
      ->type_name("FILE")
      ->check(endsIn(".json"));
  command_->add_option("--plot", files_->plot, "also draw the result there, with gnuplot: .svg, .png or .pdf")
      ->type_name("FILE")
      ->check(endsIn(".svg", ".png", ".pdf"));
}

int StudyCommand::report(const Report& report) const {
  const int status = print(report.text(), report.json());
  if (status != EX_OK || files_->plot.empty()) return status;
  const auto drawn = runGnuplot(report.drawing(files_->plot), files_->plot, "--json writes the data");
  return drawn ? EX_OK : fail(drawn.error(), EX_CANTCREAT);
}

void StudyCommand::quick(const std::string& help, const std::function<void()>& change) {
  command_->add_flag_callback("--quick", change, help);
}

template <typename Number>
void StudyCommand::number(const std::string& option, Number& value, Number lowest, Number highest,
                          const std::string& help) {
  command_->add_option(option, value, help)->check(within(lowest, highest));
}
template void StudyCommand::number(const std::string&, int&, int, int, const std::string&);
template void StudyCommand::number(const std::string&, std::size_t&, std::size_t, std::size_t,
                                   const std::string&);
template void StudyCommand::number(const std::string&, double&, double, double, const std::string&);

template <typename Number>
void StudyCommand::numbers(const std::string& option, std::vector<Number>& values, Number lowest,
                           Number highest, const std::string& help) {
  command_->add_option(option, values, help)->delimiter(',')->check(within(lowest, highest));
}
template void StudyCommand::numbers(const std::string&, std::vector<int>&, int, int, const std::string&);
template void StudyCommand::numbers(const std::string&, std::vector<double>&, double, double,
                                    const std::string&);

void StudyCommand::flag(const std::string& option, bool& value, const std::string& help) {
  command_->add_flag(option, value, help);
}

void StudyCommand::file(const std::string& option, std::string& name, const char* ending,
                        const std::string& help) {
  command_->add_option(option, name, help)->type_name("FILE")->check(endsIn(ending));
}

void StudyCommand::footer(const std::string& text) {
  command_->footer(text);
}

bool StudyCommand::chosen() const {
  return command_->parsed();
}

std::string StudyCommand::path() const {
  return "hapticbench " + command_->get_name();
}

void StudyCommand::names(const std::string& option, std::vector<std::string>& chosen,
                         const std::vector<std::string>& all, const std::string& usual) {
  pick(option, all, usual, [&chosen](const std::vector<std::string>& picked) { chosen = picked; });
}

void StudyCommand::pick(const std::string& option, const std::vector<std::string>& all,
                        const std::string& usual,
                        const std::function<void(const std::vector<std::string>&)>& set) {
  const std::string help = fmt::format("of {} ({})", fmt::join(all, ", "), usual);
  command_->add_option_function<std::vector<std::string>>(option, set, help)
      ->delimiter(',')
      ->check(CLI::IsMember(all).description(""));  // the help names them already
}

void StudyCommand::seed(std::uint32_t& seed, const std::string& help) {
  command_->add_option("--seed", seed, help)
      ->check(within(std::uint32_t{0}, std::numeric_limits<std::uint32_t>::max()));
}

void StudyCommand::recordings(std::string& folder) {
  const char* usual = std::getenv("HAPTICD_RECORDINGS");
  folder = usual != nullptr ? usual : "../shared/recordings";
  command_
      ->add_option("--recordings", folder,
                   "folder of recordings ($HAPTICD_RECORDINGS, or ../shared/recordings)")
      ->type_name("FOLDER");
}

void StudyCommand::parts() {
  addPartOptions(*command_, files_->division, "--json");
  footer(
      fmt::format("Cases are independent, so that several computers can share them (tools/slurm):\n"
                  "  {0} --part 1/2 --json part1.json\n"
                  "  {0} --part 2/2 --json part2.json\n"
                  "  {0} --join part1.json part2.json",
                  path()));
}

/// The options given, but for those that say where something is: two parts with the same ones are of one run.
std::vector<std::string> StudyCommand::optionsOfResults() const {
  std::vector<std::string> options;
  for (const CLI::Option* const option : command_->get_options()) {
    const std::string name = option->get_name();
    if (option->count() == 0 || name == "--part" || name == "--json" || name == "--plot" ||
        name == "--recordings")
      continue;
    options.push_back(fmt::format("{}={}", name, fmt::join(option->results(), ",")));
  }
  return options;
}

int StudyCommand::run() const {
  if (files_->division.files.empty()) return run_(*this);
  const auto done = join();
  return done ? run_(*this) : fail(done.error(), EX_DATAERR);
}

namespace {

base::Error refusal(const std::string& file, std::string what) {
  return {file, std::move(what), "compute the part again with --part"};
}

}  // namespace

base::Result<void> StudyCommand::join() const {
  const std::vector<std::string>& names = files_->division.files;
  auto whole = joinFiles(names, path(), HAPTICD_VERSION);
  if (!whole) return std::unexpected(whole.error());
  try {
    std::vector<std::string> options(whole->run.options.rbegin(), whole->run.options.rend());
    const std::string json = files_->json;
    const std::string plot = files_->plot;
    command_->parse(options);  // which takes the first one from the end
    files_->json = json;
    files_->plot = plot;
  } catch (const CLI::Error& problem) {
    return std::unexpected(
        refusal(names.front(), fmt::format("names options that are none: {}", problem.what())));
  }
  files_->joined = std::move(*whole);
  return {};
}

int StudyCommand::divided(const Cases& cases) const {
  const Division& division = files_->division;
  if (const auto& joined = files_->joined) {
    const auto refused = [&](std::string what) {
      return fail(refusal(division.files.front(), std::move(what)), EX_DATAERR);
    };
    if (joined->run.cases != cases.count)
      return refused(fmt::format("is of {} cases, its options give {}", joined->run.cases, cases.count));
    try {
      cases.read(joined->results);
    } catch (const std::exception& problem) {
      return refused(fmt::format("holds results that cannot be read: {}", problem.what()));
    }
    return report(cases.report());
  }
  for (std::size_t index = 0; index < cases.count; ++index) {
    if (division.part && !division.part->has(index)) continue;
    showProgress(fmt::format("case {} of {}", index + 1, cases.count));
    cases.measure(index);
  }
  if (!division.part) return report(cases.report());
  const PartFile file{.run = {.program = path(),
                              .version = HAPTICD_VERSION,
                              .options = optionsOfResults(),
                              .cases = cases.count},
                      .part = *division.part,
                      .results = cases.write()};
  return print(fmt::format("part {}: {} of {} cases\n", nameOf(file.part), file.results.size(), cases.count),
               partText(file));
}

int StudyCommand::print(const std::string& text, const std::string& json) const {
  showProgress("");
  fmt::print("{}", text);
  return writeReport(files_->json, json);
}

}  // namespace hapticd::tools
