// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

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

}  // namespace hapticd::tools
