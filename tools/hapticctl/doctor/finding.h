// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hapticd::tools {

/// ok: as it should be, or irrelevant. warn: hapticd works, but with more latency, less safely or with fewer
/// features than it could, or the check could not find out. fail: in this state hapticd cannot work.
enum class Verdict { ok, warn, fail };

/// The result of a check.
struct Finding {
  Verdict verdict = Verdict::ok;
  std::string name;    ///< name of the check
  std::string fact;    ///< what was found
  std::string remedy;  ///< what to do about it: a command or a line for a file; empty: nothing
};

using Findings = std::vector<Finding>;

/// "ok", "warn" or "fail".
std::string_view verdictText(Verdict verdict);

/// The exit status for these findings: 0, or 1 if one fails.
int exitStatus(const Findings& findings);

/// The findings for people, a line each: "warn  clock: hpet (what to do)".
std::string textOf(const Findings& findings);

/// The findings for programs: an array of {name, verdict, fact, remedy}.
std::string jsonOf(const Findings& findings);

}  // namespace hapticd::tools
