// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hapticd::tools {

/// An HDF5 identifier, which is closed with the object.
class Hdf5Handle {
 public:
  Hdf5Handle(hid_t id, herr_t (*closing)(hid_t)) : id_(id), close_(closing) {}
  Hdf5Handle(Hdf5Handle&& other) noexcept;
  Hdf5Handle& operator=(Hdf5Handle&&) = delete;
  ~Hdf5Handle();

  operator hid_t() const { return id_; }
  bool good() const { return id_ >= 0; }
  void reset(hid_t id) {
    close();
    id_ = id;
  }
  /// Closes the object; returns false if written data did not reach the file.
  bool close();

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// A new HDF5 file in memory. libhdf5 itself must not write to the disk, because it crashes if the disk is
/// full.
class Hdf5Memory {
 public:
  Hdf5Memory();

  bool good() const { return file_.good(); }
  hid_t id() const { return file_; }
  /// The whole file, valid while this object lives and nothing is added; nothing if it could not be finished.
  std::optional<std::string_view> content();

 private:
  Hdf5Handle access_;
  Hdf5Handle file_;
};

/// The HDF5 type of texts of variable length.
Hdf5Handle hdf5TextType();

// Each function adds an attribute to an object; false if it cannot be written.
bool addAttribute(hid_t object, const std::string& name, const std::string& value);
bool addAttribute(hid_t object, const std::string& name, double value);
bool addAttribute(hid_t object, const std::string& name, std::int64_t value);
bool addAttribute(hid_t object, const std::string& name, std::span<const std::string_view> values);

/// Adds a dataset that holds one text; false if it cannot be written.
bool addText(hid_t group, const std::string& name, const std::string& text);

/// A dataset that grows by rows, each of `width` numbers or of one text.
class Hdf5Column {
 public:
  /// `type`: type of a value, in memory and in the file.
  Hdf5Column(hid_t group, const std::string& name, hid_t type, std::size_t width);

  /// Adds a value to the current row.
  void add(const void* value, std::size_t bytes);
  void add(const std::string& text) { texts_.push_back(text); }
  void endRow();
  /// Writes the remaining rows; false if something could not be written.
  bool finish();
  hid_t dataset() const { return dataset_; }

 private:
  void write();

  std::size_t width_;
  Hdf5Handle type_;
  Hdf5Handle dataset_;
  std::vector<unsigned char> values_;  ///< the rows that are not written yet
  std::vector<std::string> texts_;     ///< the same, of a dataset of texts
  hsize_t pending_ = 0;
  hsize_t rows_ = 0;
  bool good_;
};

}  // namespace hapticd::tools
