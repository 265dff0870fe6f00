// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "tools/lib/child/child_process.h"

namespace hapticd::tools {

/// The person at the device.
class Person {
 public:
  virtual ~Person() = default;
  virtual void say(const std::string& text) = 0;
  /// Whether the person has given up meanwhile.
  virtual bool givesUp() const { return false; }
  /// Waits until the person is ready; false: the person gave up.
  virtual bool isReady(const std::string& request) = 0;
  /// A question that is answered by yes or no; nothing: the person gave up.
  virtual std::optional<bool> answer(const std::string& question) = 0;
};

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
