// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "config/base/error.h"

/// A run over many independent cases, divided so that several computers can share it: each computes a part
/// of the cases and writes a file; the files joined hold what the undivided run computes, to the bit.
namespace hapticd::tools {

/// Part `number` (1..count) of `count`.
struct Part {
  std::size_t number = 1;
  std::size_t count = 1;

  /// Whether case `index` is of this part. Every case is of exactly one part. The cases are dealt in turn,
  /// beginning one part later in each round, so that a cost that recurs with the period of `count` does not
  /// fall on the same part always.
  bool has(std::size_t index) const { return (index + index / count) % count == number - 1; }
  friend bool operator==(const Part&, const Part&) = default;
};

inline constexpr std::size_t kMaxParts = 100'000;

/// "3/16".
std::string nameOf(const Part& part);

/// Reads what nameOf() writes.  Errors: not of that form or out of range, with the range.
base::Result<Part> parsePart(const std::string& text);

/// The run that a part is of. Parts of different runs cannot be joined.
struct DividedRun {
  std::string program{};                            ///< and subcommand
  std::string version{};                            ///< of the program
  std::vector<std::string> options{};               ///< that the results depend on
  nlohmann::json input = nlohmann::json::object();  ///< whatever else they depend on
  std::size_t cases = 0;
  friend bool operator==(const DividedRun&, const DividedRun&) = default;
};

/// The results of the cases of a part.
struct PartFile {
  std::string name{};  ///< of the file, for messages
  DividedRun run{};
  Part part{};
  std::vector<nlohmann::json> results{};  ///< in the order of the cases
};

/// As JSON. Numbers read back to the same bits.
std::string partText(const PartFile& file);

/// Reads what partText() has written. `name`: of the file, for errors.
/// Errors: it is not a part of such a run by this program and version, or is incomplete.
base::Result<PartFile> parsePartFile(const std::string& name, const std::string& text,
                                     const std::string& program, const std::string& version);

/// The whole run from all its parts, in any order.
/// Errors: names the file that is of another run, of another division or there twice, or the parts that are
/// missing.
base::Result<PartFile> joinParts(const std::vector<PartFile>& parts);

/// Reads and joins the files.  Errors: those of the two functions above; a file cannot be read.
base::Result<PartFile> joinFiles(const std::vector<std::string>& names, const std::string& program,
                                 const std::string& version);

/// What the options --part and --join request.
struct Division {
  std::optional<Part> part{};
  std::vector<std::string> files{};  ///< to be joined; empty: none
};

/// Adds both options to `app`. `output`: the option that names the file of a part, the only one that --join
/// goes with. `division` outlives `app`.
void addPartOptions(CLI::App& app, Division& division, const std::string& output);

}  // namespace hapticd::tools
