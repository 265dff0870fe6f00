// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/engine/study.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <limits>

#include "config/base/whole_file.h"
#include "tools/lib/options/option_checks.h"
#include "tools/lib/plot/gnuplot.h"

namespace hapticd::tools {

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
    : command_(app.add_subcommand(name, description)) {
  command_->add_option("--json", *json_file_, "also write the result there, for programs")
      ->type_name("FILE")
      ->check(endsIn(".json"));
  command_->add_option("--plot", *plot_file_, "also draw the result there, with gnuplot: .svg, .png or .pdf")
      ->type_name("FILE")
      ->check(endsIn(".svg", ".png", ".pdf"));
}

int StudyCommand::report(const Report& report) const {
  const int status = print(report.text(), report.json());
  if (status != EX_OK || plot_file_->empty()) return status;
  const auto drawn = runGnuplot(report.drawing(*plot_file_), *plot_file_, "--json writes the data");
  return drawn ? EX_OK : fail(drawn.error(), EX_CANTCREAT);
}

void StudyCommand::quick(const std::string& help, const std::function<void()>& change) {
  command_->add_flag_callback("--quick", change, help);
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
  addPartOptions(*command_, *division_, "--json");
  command_->footer(
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
  if (division_->files.empty()) return run_(*this);
  const auto done = join();
  return done ? run_(*this) : fail(done.error(), EX_DATAERR);
}

base::Result<void> StudyCommand::join() const {
  auto whole = joinFiles(division_->files, path(), HAPTICD_VERSION);
  if (!whole) return std::unexpected(whole.error());
  try {
    std::vector<std::string> options(whole->run.options.rbegin(), whole->run.options.rend());
    const std::string json_file = *json_file_;
    const std::string plot_file = *plot_file_;
    command_->parse(options);  // which takes the first one from the end
    *json_file_ = json_file;
    *plot_file_ = plot_file;
  } catch (const CLI::Error& problem) {
    return std::unexpected(base::Error{division_->files.front(),
                                       fmt::format("names options that are none: {}", problem.what()),
                                       "compute the part again with --part"});
  }
  joined_->emplace(std::move(*whole));
  return {};
}

base::Result<void> StudyCommand::fromJoined(std::size_t cases,
                                            const std::function<void(const nlohmann::json&)>& read) const {
  const auto refusal = [this](const std::string& what) {
    return std::unexpected(base::Error{division_->files.front(), what, "compute the part again with --part"});
  };
  if (joined()->run.cases != cases)
    return refusal(fmt::format("is of {} cases, its options give {}", joined()->run.cases, cases));
  try {
    read(joined()->results);
  } catch (const std::exception& problem) {
    return refusal(fmt::format("holds results that cannot be read: {}", problem.what()));
  }
  return {};
}

int StudyCommand::writePart(std::size_t cases, const nlohmann::json& input,
                            const nlohmann::json& results) const {
  const PartFile file{.run = {path(), HAPTICD_VERSION, optionsOfResults(), input, cases},
                      .part = *division_->part,
                      .results = results};
  return print(fmt::format("part {}: {} of {} cases\n", nameOf(file.part), results.size(), cases),
               partText(file));
}

int StudyCommand::print(const std::string& text, const std::string& json) const {
  showProgress("");
  fmt::print("{}", text);
  return writeReport(*json_file_, json);
}

}  // namespace hapticd::tools
