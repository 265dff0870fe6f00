// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hapticd::tools {

/// ok: as it should be, or of no matter. warn: hapticd works, but later, less safely or with less than it
/// could, or it could not be found out. fail: as it is hapticd cannot do its work.
enum class Verdict { ok, warn, fail };

/// What one check says.
struct Finding {
  Verdict verdict = Verdict::ok;
  std::string name;    ///< of the check
  std::string fact;    ///< what was found
  std::string remedy;  ///< what to do about it, a command or a line for a file; empty if nothing
};

using Findings = std::vector<Finding>;

/// "ok", "warn" or "fail".
std::string_view verdictText(Verdict verdict);

/// What the checks together exit with: 0, or 1 when one fails.
int exitStatus(const Findings& findings);

/// For people, a line each: "warn  clock: hpet (what to do)".
std::string textOf(const Findings& findings);

/// For programs: an array of {name, verdict, fact, remedy}.
std::string jsonOf(const Findings& findings);

}  // namespace hapticd::tools
