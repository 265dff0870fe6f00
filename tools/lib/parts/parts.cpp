// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/parts/parts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <fstream>
#include <iterator>
#include <map>

#include "config/base/value_text.h"
#include "tools/lib/options/option_checks.h"

namespace hapticd::tools {
namespace {

using Json = nlohmann::json;

constexpr const char* kComputeAgain = "compute the part again with --part";

std::unexpected<base::Error> refuse(const std::string& where, std::string what, std::string remedy) {
  return std::unexpected(base::Error{where, std::move(what), std::move(remedy)});
}

std::size_t casesOf(const Part& part, std::size_t all) {
  std::size_t cases = 0;
  for (std::size_t index = 0; index < all; ++index) cases += part.has(index) ? 1U : 0U;
  return cases;
}

/// What makes `other` a part of another run than `part`.
std::string difference(const PartFile& part, const PartFile& other) {
  const auto text = [](const std::vector<std::string>& options) {
    return options.empty() ? "no options" : fmt::format("{}", fmt::join(options, " "));
  };
  if (other.run.options != part.run.options) {
    return fmt::format("was computed with {}, but {} with {}", text(other.run.options), part.name,
                       text(part.run.options));
  }
  if (other.run.cases != part.run.cases)
    return fmt::format("is of {} cases, but {} of {}", other.run.cases, part.name, part.run.cases);
  return fmt::format("was computed from other input than {}", part.name);
}

}  // namespace

std::string nameOf(const Part& part) {
  return fmt::format("{}/{}", part.number, part.count);
}

base::Result<Part> parsePart(const std::string& text) {
  const std::size_t slash = text.find('/');
  const auto number = base::numberFrom<std::size_t>(text.substr(0, slash));
  const auto count =
      slash == std::string::npos ? std::nullopt : base::numberFrom<std::size_t>(text.substr(slash + 1));
  if (number && count && *number >= 1 && *number <= *count && *count <= kMaxParts)
    return Part{*number, *count};
  return refuse("",
                fmt::format("{} is not K/N with whole numbers N in 1..{} and K in 1..N", base::inQuotes(text),
                            kMaxParts),
                "for example --part 3/8");
}

std::string partText(const PartFile& file) {
  nlohmann::ordered_json document{{"part_of", file.run.program}, {"version", file.run.version},
                                  {"options", file.run.options}, {"input", file.run.input},
                                  {"cases", file.run.cases},     {"part", file.part.number},
                                  {"parts", file.part.count},    {"results", file.results}};
  return document.dump(-1) + "\n";
}

base::Result<PartFile> parsePartFile(const std::string& name, const std::string& text,
                                     const std::string& program, const std::string& version) {
  try {
    const Json document = Json::parse(text);
    PartFile file{.name = name};
    document.at("part_of").get_to(file.run.program);
    document.at("version").get_to(file.run.version);
    if (file.run.program != program) {
      return refuse(name, fmt::format("is a part of {}, not of {}", file.run.program, program),
                    "join only what this command has written");
    }
    if (file.run.version != version) {
      return refuse(name, fmt::format("is of version {}, this is {}", file.run.version, version),
                    "compute and join all parts with one version");
    }
    document.at("options").get_to(file.run.options);
    file.run.input = document.at("input");
    document.at("cases").get_to(file.run.cases);
    const auto part =
        parsePart(fmt::format("{}/{}", document.at("part").dump(), document.at("parts").dump()));
    if (!part) return refuse(name, "has the impossible part number: " + part.error().what, kComputeAgain);
    file.part = *part;
    document.at("results").get_to(file.results);
    const std::size_t cases = casesOf(file.part, file.run.cases);
    if (file.results.size() != cases) {
      return refuse(
          name, fmt::format("holds {} cases, part {} has {}", file.results.size(), nameOf(file.part), cases),
          kComputeAgain);
    }
    return file;
  } catch (const Json::exception&) {
    return refuse(name, fmt::format("is not a part of {}, or is incomplete", program), kComputeAgain);
  }
}

base::Result<PartFile> joinParts(const std::vector<PartFile>& parts) {
  const PartFile& first = parts.at(0);
  std::map<std::size_t, const PartFile*> by_number;
  for (const PartFile& file : parts) {
    if (file.run != first.run) {
      return refuse(file.name, difference(first, file), "join only parts of one run");
    }
    if (file.part.count != first.part.count) {
      return refuse(
          file.name,
          fmt::format("is part {}, but {} is part {}", nameOf(file.part), first.name, nameOf(first.part)),
          "join only parts of one division");
    }
    if (const auto [other, is_new] = by_number.emplace(file.part.number, &file); !is_new) {
      return refuse(file.name,
                    fmt::format("is part {}, and so is {}", nameOf(file.part), other->second->name),
                    "name each part once");
    }
  }
  std::string missing;
  for (std::size_t number = 1; number <= first.part.count; ++number) {
    if (!by_number.contains(number)) missing += " " + nameOf(Part{number, first.part.count});
  }
  if (!missing.empty()) return refuse("--join", "these parts are missing:" + missing, kComputeAgain);
  PartFile whole{.name = "joined", .run = first.run};
  std::map<std::size_t, std::size_t> taken;
  for (std::size_t index = 0; index < first.run.cases; ++index) {
    for (const auto& [number, file] : by_number) {
      if (file->part.has(index)) whole.results.push_back(file->results.at(taken[number]++));
    }
  }
  return whole;
}

base::Result<PartFile> joinFiles(const std::vector<std::string>& names, const std::string& program,
                                 const std::string& version) {
  std::vector<PartFile> parts;
  for (const std::string& name : names) {
    std::ifstream stream(name);
    const std::string text{std::istreambuf_iterator<char>(stream), {}};
    if (!stream) return refuse(name, "cannot be read", "check --join");
    auto part = parsePartFile(name, text, program, version);
    if (!part) return part;
    parts.push_back(std::move(*part));
  }
  if (parts.empty()) return refuse("--join", "names no files", "name all parts");
  return joinParts(parts);
}

void addPartOptions(CLI::App& app, Division& division, const std::string& output) {
  const auto check = [](std::string& text) {
    const auto part = parsePart(text);
    return part ? std::string() : part.error().text();
  };
  app.add_option_function<std::string>(
         "--part", [&division](const std::string& text) { division.part = *parsePart(text); },
         "compute only part K of N of the cases, and write it to the file of " + output)
      ->type_name("K/N")
      ->check(CLI::Validator(check, ""))
      ->needs(output);
  CLI::Option* const join =
      app.add_option("--join", division.files, "report what the files of all parts hold; computes nothing")
          ->type_name("FILE")
          ->expected(1, static_cast<int>(kMaxParts));
  // not by excludes(), which the help would show at every option
  app.final_callback([&app, join, output] {
    if (join->count() == 0) return;
    for (const CLI::Option* const option : app.get_options()) {
      const bool may_be_there = option == join || option->check_name(output);
      if (option->count() > 0 && !may_be_there) throw CLI::ExcludesError("--join", option->get_name());
    }
  });
}

}  // namespace hapticd::tools
