// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/trace/hdf5_file.h"

#include <array>
#include <utility>

namespace hapticd::tools {
namespace {

constexpr hsize_t kRowsAtOnce = 4096;
constexpr unsigned kCompression = 4;  // of 9: with more, files hardly get smaller

Hdf5Handle createDataset(hid_t group, const std::string& name, hid_t type, std::size_t width) {
  const int dimensions = width > 1 ? 2 : 1;
  const std::array<hsize_t, 2> none{0, width}, most{H5S_UNLIMITED, width}, chunk{kRowsAtOnce, width};
  const Hdf5Handle space(::H5Screate_simple(dimensions, none.data(), most.data()), ::H5Sclose);
  const Hdf5Handle layout(::H5Pcreate(H5P_DATASET_CREATE), ::H5Pclose);
  ::H5Pset_chunk(layout, dimensions, chunk.data());
  ::H5Pset_shuffle(layout);
  ::H5Pset_deflate(layout, kCompression);
  return {::H5Dcreate2(group, name.c_str(), type, space, H5P_DEFAULT, layout, H5P_DEFAULT), ::H5Dclose};
}

bool writeAttribute(hid_t object, const std::string& name, hid_t space,
                    const std::vector<const char*>& values) {
  const Hdf5Handle type = hdf5TextType();
  const Hdf5Handle attribute(::H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT),
                             ::H5Aclose);
  return attribute.good() && ::H5Awrite(attribute, type, values.data()) >= 0;
}

bool writeNumber(hid_t object, const std::string& name, hid_t type, const void* value) {
  const Hdf5Handle space(::H5Screate(H5S_SCALAR), ::H5Sclose);
  const Hdf5Handle attribute(::H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT),
                             ::H5Aclose);
  return attribute.good() && ::H5Awrite(attribute, type, value) >= 0;
}

}  // namespace

Hdf5Handle::Hdf5Handle(Hdf5Handle&& other) noexcept
    : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}

Hdf5Handle::~Hdf5Handle() {
  close();
}

bool Hdf5Handle::close() {
  const hid_t id = std::exchange(id_, H5I_INVALID_HID);
  return id < 0 || close_(id) >= 0;
}

Hdf5Memory::Hdf5Memory()
    : access_(::H5Pcreate(H5P_FILE_ACCESS), ::H5Pclose), file_(H5I_INVALID_HID, ::H5Fclose) {
  constexpr std::size_t kGrowth = 1 << 24;
  constexpr hbool_t kOnDisk = 0;
  if (!access_.good() || ::H5Pset_fapl_core(access_, kGrowth, kOnDisk) < 0) return;
  file_.reset(::H5Fcreate("in memory", H5F_ACC_TRUNC, H5P_DEFAULT, access_));
}

std::optional<std::string_view> Hdf5Memory::content() {
  void* memory = nullptr;
  hsize_t bytes = 0;
  // what the core driver calls a handle is the address of the pointer to its memory
  const bool found = ::H5Fflush(file_, H5F_SCOPE_GLOBAL) >= 0 && ::H5Fget_filesize(file_, &bytes) >= 0 &&
                     ::H5Fget_vfd_handle(file_, access_, &memory) >= 0 && memory != nullptr;
  if (!found) return std::nullopt;
  return std::string_view(*static_cast<const char* const*>(memory), bytes);
}

Hdf5Handle hdf5TextType() {
  Hdf5Handle type(::H5Tcopy(H5T_C_S1), ::H5Tclose);
  ::H5Tset_size(type, H5T_VARIABLE);
  ::H5Tset_cset(type, H5T_CSET_UTF8);
  return type;
}

bool addAttribute(hid_t object, const std::string& name, const std::string& value) {
  const Hdf5Handle space(::H5Screate(H5S_SCALAR), ::H5Sclose);
  return writeAttribute(object, name, space, {value.c_str()});
}

bool addAttribute(hid_t object, const std::string& name, double value) {
  return writeNumber(object, name, H5T_NATIVE_DOUBLE, &value);
}

bool addAttribute(hid_t object, const std::string& name, std::int64_t value) {
  return writeNumber(object, name, H5T_NATIVE_INT64, &value);
}

bool addText(hid_t group, const std::string& name, const std::string& text) {
  const Hdf5Handle space(::H5Screate(H5S_SCALAR), ::H5Sclose);
  const Hdf5Handle type = hdf5TextType();
  Hdf5Handle dataset(::H5Dcreate2(group, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                     ::H5Dclose);
  const char* const pointer = text.c_str();
  const bool written =
      dataset.good() && ::H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, &pointer) >= 0;
  return dataset.close() && written;
}

bool addAttribute(hid_t object, const std::string& name, std::span<const std::string_view> values) {
  const hsize_t count = values.size();
  const Hdf5Handle space(::H5Screate_simple(1, &count, nullptr), ::H5Sclose);
  const std::vector<std::string> texts(values.begin(), values.end());
  std::vector<const char*> pointers;
  for (const std::string& text : texts) pointers.push_back(text.c_str());
  return writeAttribute(object, name, space, pointers);
}

Hdf5Column::Hdf5Column(hid_t group, const std::string& name, hid_t type, std::size_t width)
    : width_(width),
      type_(::H5Tcopy(type), ::H5Tclose),
      dataset_(createDataset(group, name, type_, width)),
      good_(dataset_.good()) {}

void Hdf5Column::add(const void* value, std::size_t bytes) {
  const auto* const first = static_cast<const unsigned char*>(value);
  values_.insert(values_.end(), first, first + bytes);
}

void Hdf5Column::endRow() {
  if (++pending_ == kRowsAtOnce) write();
}

bool Hdf5Column::finish() {
  write();
  return dataset_.close() && good_;
}

void Hdf5Column::write() {
  if (pending_ == 0 || !good_) return;
  const int dimensions = width_ > 1 ? 2 : 1;
  const std::array<hsize_t, 2> all{rows_ + pending_, width_}, begin{rows_, 0}, size{pending_, width_};
  std::vector<const char*> pointers;
  for (const std::string& text : texts_) pointers.push_back(text.c_str());
  good_ = ::H5Dset_extent(dataset_, all.data()) >= 0;
  const Hdf5Handle file_space(::H5Dget_space(dataset_), ::H5Sclose);
  const Hdf5Handle memory_space(::H5Screate_simple(dimensions, size.data(), nullptr), ::H5Sclose);
  good_ = good_ &&
          ::H5Sselect_hyperslab(file_space, H5S_SELECT_SET, begin.data(), nullptr, size.data(), nullptr) >= 0;
  const void* const data = pointers.empty() ? static_cast<const void*>(values_.data()) : pointers.data();
  good_ = good_ && ::H5Dwrite(dataset_, type_, memory_space, file_space, H5P_DEFAULT, data) >= 0;
  rows_ += pending_;
  pending_ = 0;
  values_.clear();
  texts_.clear();
}

}  // namespace hapticd::tools
