// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hapticd::test {

/// All present and future memory of the process, locked while the object lives, if that is permitted.
class LockedMemory {
 public:
  LockedMemory();
  ~LockedMemory();
  LockedMemory(const LockedMemory&) = delete;
  LockedMemory& operator=(const LockedMemory&) = delete;

  /// As the kernel sees it: sanitizers say that they have locked memory and do nothing.
  bool locked() const { return locked_; }

 private:
  bool locked_;
};

/// A page that no thread has touched yet, also while memory is locked.
class UntouchedPage {
 public:
  UntouchedPage();
  ~UntouchedPage();
  UntouchedPage(const UntouchedPage&) = delete;
  UntouchedPage& operator=(const UntouchedPage&) = delete;

  void touch();

 private:
  void* page_;
};

}  // namespace hapticd::test
