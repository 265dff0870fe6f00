// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hapticd::test {

/// Locks all present and future memory of the process while the object lives, if permitted.
class LockedMemory {
 public:
  LockedMemory();
  ~LockedMemory();
  LockedMemory(const LockedMemory&) = delete;
  LockedMemory& operator=(const LockedMemory&) = delete;

  /// Returns whether memory is locked according to the kernel; sanitizers pretend to lock memory without
  /// doing so.
  bool locked() const { return locked_; }

 private:
  bool locked_;
};

/// A page that no thread has touched yet, even while memory is locked.
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
