// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <source_location>
#include <string>

#include "made_up_machine.h"
#include "tools/hapticctl/doctor/checks.h"

namespace hapticd::tools {

using enum Verdict;

/// Whether a finding has this verdict, and these texts in its fact and its remedy.
inline testing::AssertionResult says(const Finding& finding, Verdict verdict, const std::string& fact,
                                     const std::string& remedy) {
  if (finding.verdict == verdict && finding.fact.find(fact) != std::string::npos &&
      finding.remedy.find(remedy) != std::string::npos) {
    return testing::AssertionSuccess();
  }
  return testing::AssertionFailure() << "says: " << textOf(Findings{finding});
}

/// `hapticctl doctor` on the files of a simulated machine, asked by a member of the control group; the
/// service is installed, and no daemon answers unless a test says so.
class DoctorOnFiles : public testing::Test {
 protected:
  /// The one finding of a check.
  Finding only(Findings (*check)(const Examination&)) const {
    const Findings findings = check(box);
    EXPECT_EQ(findings.size(), 1U) << textOf(findings);
    return findings.empty() ? Finding{} : findings.front();
  }

  /// Expects of a check one finding, with this verdict and these texts in its fact and its remedy.
  void finds(Findings (*check)(const Examination&), Verdict verdict, const std::string& fact,
             const std::string& remedy = "",
             const std::source_location& place = std::source_location::current()) const {
    const testing::ScopedTrace trace(place.file_name(), static_cast<int>(place.line()), "");
    EXPECT_TRUE(says(only(check), verdict, fact, remedy));
  }

  test::MadeUpMachine files;
  Examination box{Machine(files.root()),
                  {"anna", 1000, {1000, 4242}, 80, kNoLimit},
                  test::goodUnit(),
                  {},
                  {},
                  {},
                  {},
                  {}};
};

}  // namespace hapticd::tools
