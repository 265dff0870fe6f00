// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "tools/lib/child/child_process.h"
#include "tools/lib/device_check/person.h"

namespace hapticd::tools {

/// The person at standard input and output, who may also give up by Ctrl-C.
class PersonAtTerminal final : public Person {
 public:
  explicit PersonAtTerminal(const Interrupt& interrupt) : interrupt_(interrupt) {}

  void say(const std::string& text) override;
  bool givesUp() const override { return interrupt_.requested(); }
  bool isReady(const std::string& request) override;
  std::optional<bool> answer(const std::string& question) override;

 private:
  std::optional<std::string> answerLine() const;

  const Interrupt& interrupt_;
};

}  // namespace hapticd::tools
