// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

#include <expected>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/hapticctl/additions/addition_options.h"
#include "tools/hapticctl/base/calls.h"

namespace hapticd::tools {

/// What the shape of a fixture of kind `solid` is made from.
struct SolidSource {
  std::string mesh;    ///< file; empty: none
  std::string labels;  ///< file; empty: none
  std::string label;   ///< of the label map: name or value of a segment
  std::string unit;    ///< of the mesh: "mm", "m"; empty: guessed from its size
  std::string axes;    ///< "LPS", "RAS", for files that do not state theirs; empty: LPS
  double tolerance_m = 0.0005;
  Json centre_m;       ///< place of the centre of its box; null: not given
  bool check = false;  ///< only state what would be sent
  ModelOptions model;
  std::vector<const CLI::Option*> needing;  ///< options that mean nothing without a mesh or a label map

  bool given() const { return !mesh.empty() || !labels.empty(); }
};

/// Adds the options of a mesh, a label map and their registration.
void addSolidOptions(CLI::App& command, const std::shared_ptr<SolidSource>& source);

/// Reports an option that needs a mesh or a label map where there is none, and returns the exit code.
std::optional<int> refusedWithoutSource(const SolidSource& source, bool json);

/// Makes the shape, states its error, stores it in the box and adds the fixture. `definition`: its members
/// that were given. Returns the exit code.
int addSolid(const CommandOptions& options, const SolidSource& source, Json definition, bool replace);

}  // namespace hapticd::tools
