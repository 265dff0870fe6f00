#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hapticd::tools {

/// What HDF5 calls an identifier, closed with the object.
class Hdf5Handle {
 public:
  Hdf5Handle(hid_t id, herr_t (*closing)(hid_t)) : id_(id), close_(closing) {}
  Hdf5Handle(Hdf5Handle&& other) noexcept;
  Hdf5Handle& operator=(Hdf5Handle&&) = delete;
  ~Hdf5Handle();

  operator hid_t() const { return id_; }
  bool good() const { return id_ >= 0; }
  /// False: what was written is not in the file.
  bool close();

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// The type of texts of any length.
Hdf5Handle hdf5TextType();

// Attributes of an object.  False: they cannot be written.
bool addAttribute(hid_t object, const std::string& name, const std::string& value);
bool addAttribute(hid_t object, const std::string& name, std::span<const std::string_view> values);

/// A dataset that grows by rows of `width` numbers, or of one text.
class Hdf5Column {
 public:
  /// `type`: of a value in memory and in the file.
  Hdf5Column(hid_t group, const std::string& name, hid_t type, std::size_t width);

  /// One value of a row.
  void add(const void* value, std::size_t bytes);
  void add(const std::string& text) { texts_.push_back(text); }
  void endRow();
  /// Writes what is left.  False: something could not be written.
  bool finish();
  hid_t dataset() const { return dataset_; }

 private:
  void write();

  std::size_t width_;
  Hdf5Handle type_;
  Hdf5Handle dataset_;
  std::vector<unsigned char> values_;  ///< of the rows that are not written yet
  std::vector<std::string> texts_;     ///< or these
  hsize_t pending_ = 0;
  hsize_t rows_ = 0;
  bool good_;
};

}  // namespace hapticd::tools
