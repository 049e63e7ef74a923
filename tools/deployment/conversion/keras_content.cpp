// SPDX-License-Identifier: Apache-2.0
#include "conversion/keras_content.hpp"

#include <fmt/format.h>

#include <cstring>
#include <filesystem>
#include <span>

#include "core/isolated.hpp"
#include "exchange/hdf5_handle.hpp"

namespace ravencal::conversion {
namespace {

using exchange::Hdf5Handle;

// A network for a 1 kHz loop has less than a million weights.
constexpr hsize_t kMostWeights = 1U << 22U;
constexpr hsize_t kMostNames = 1024;
constexpr std::size_t kLongestText = 16U << 20U;

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// One text or a list of them; none if the attribute is absent or no text.
std::vector<std::string> texts_of(hid_t object, const std::string& name) {
  if (H5Aexists(object, name.c_str()) <= 0) return {};
  const Hdf5Handle attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose);
  const Hdf5Handle type(H5Aget_type(attribute.get()), H5Tclose);
  const Hdf5Handle space(H5Aget_space(attribute.get()), H5Sclose);
  const hssize_t count = H5Sget_simple_extent_npoints(space.get());
  if (!type.ok() || H5Tget_class(type.get()) != H5T_STRING || count < 1 ||
      static_cast<hsize_t>(count) > kMostNames) {
    return {};
  }
  std::vector<std::string> texts;
  if (H5Tis_variable_str(type.get()) > 0) {
    std::vector<char*> values(static_cast<std::size_t>(count), nullptr);
    if (H5Aread(attribute.get(), type.get(), values.data()) < 0) return {};
    for (const char* value : values) texts.emplace_back(value == nullptr ? "" : value);
    (void)H5Dvlen_reclaim(type.get(), space.get(), H5P_DEFAULT, values.data());
    return texts;
  }
  const std::size_t size = H5Tget_size(type.get());
  if (size < 1 || size > kLongestText / static_cast<std::size_t>(count)) return {};
  std::vector<char> bytes(size * static_cast<std::size_t>(count));
  if (H5Aread(attribute.get(), type.get(), bytes.data()) < 0) return {};
  for (std::size_t at = 0; at < bytes.size(); at += size) {
    const std::string_view text(bytes.data() + at, size);
    texts.emplace_back(text.substr(0, text.find('\0')));
  }
  return texts;
}

/// A list that Keras splits into NAME0, NAME1, ... where it is long.
std::vector<std::string> names_of(hid_t group, const std::string& name) {
  if (H5Aexists(group, name.c_str()) > 0) return texts_of(group, name);
  std::vector<std::string> all;
  for (std::size_t part = 0; all.size() < kMostNames; ++part) {
    const auto names = texts_of(group, fmt::format("{}{}", name, part));
    if (names.empty()) break;
    all.insert(all.end(), names.begin(), names.end());
  }
  return all;
}

core::Result<RowMajor> tensor_of(hid_t group, const std::string& path) {
  const Hdf5Handle set(H5Dopen2(group, path.c_str(), H5P_DEFAULT), H5Dclose);
  if (!set.ok()) return core::data_error(fmt::format("weights '{}' are not in the file", path));
  const Hdf5Handle space(H5Dget_space(set.get()), H5Sclose);
  const int rank = H5Sget_simple_extent_ndims(space.get());
  hsize_t dims[2] = {1, 1};
  if (rank < 0 || rank > 2) {
    return core::data_error(
        fmt::format("weights '{}' have {} dimensions; at most 2 are read", path, rank));
  }
  (void)H5Sget_simple_extent_dims(space.get(), rank == 2 ? dims : dims + 1, nullptr);
  if (dims[0] < 1 || dims[1] < 1 || dims[0] > kMostWeights || dims[1] > kMostWeights ||
      dims[0] * dims[1] > kMostWeights) {
    return core::data_error(
        fmt::format("weights '{}' have the shape {} x {}", path, dims[0], dims[1]));
  }
  RowMajor values(static_cast<Eigen::Index>(dims[0]), static_cast<Eigen::Index>(dims[1]));
  if (H5Dread(set.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    return core::data_error(fmt::format("weights '{}' cannot be read as numbers", path));
  }
  if (!values.allFinite()) {
    return core::data_error(fmt::format("weights '{}' have a value that is not finite", path));
  }
  return values;
}

/// What the child sends: a text by its name, or an array of a layer; numbers and texts one after
/// the other, each text behind its length. An array of no rows has the reason behind it.
class Piece {
 public:
  void number(std::uint64_t value) { add(&value, sizeof value); }
  void text(const std::string& value) {
    number(value.size());
    add(value.data(), value.size());
  }
  void add(const void* from, std::size_t count) {
    const auto* at = static_cast<const std::uint8_t*>(from);
    bytes_.insert(bytes_.end(), at, at + count);
  }
  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
};

class PieceReader {
 public:
  explicit PieceReader(std::span<const std::uint8_t> left) : left_(left) {}
  std::uint64_t number() {
    std::uint64_t value = 0;
    copy(&value, sizeof value);
    return value;
  }
  std::string text() {
    std::string value(std::min<std::uint64_t>(number(), left_.size()), '\0');
    copy(value.data(), value.size());
    return value;
  }
  void copy(void* to, std::size_t count) {
    if (count > left_.size()) return;
    std::memcpy(to, left_.data(), count);
    left_ = left_.subspan(count);
  }
  [[nodiscard]] std::size_t left() const { return left_.size(); }

 private:
  std::span<const std::uint8_t> left_;
};

core::Status send_layer(hid_t weights, const std::string& layer, const core::TakePiece& send) {
  const Hdf5Handle group(H5Gopen2(weights, layer.c_str(), H5P_DEFAULT), H5Gclose);
  for (const std::string& name : names_of(group.get(), "weight_names")) {
    const auto tensor = tensor_of(group.get(), name);
    const RowMajor values = tensor.ok() ? *tensor : RowMajor();
    Piece piece;
    piece.text(layer);
    piece.text(name);
    piece.number(static_cast<std::uint64_t>(values.rows()));
    piece.number(static_cast<std::uint64_t>(values.cols()));
    piece.add(values.data(), static_cast<std::size_t>(values.size()) * sizeof(double));
    if (!tensor.ok()) piece.text(tensor.error().message);
    RAVENCAL_RETURN_IF_ERROR(send(piece.bytes()));
  }
  return {};
}

core::Status send_opened(hid_t file, const core::TakePiece& send) {
  const auto config = texts_of(file, "model_config");
  const Hdf5Handle weights(H5Gopen2(file, "model_weights", H5P_DEFAULT), H5Gclose);
  if (config.size() != 1 || !weights.ok()) {
    return core::data_error(
        "holds no whole Keras model (weights only?); save it by model.save(\"model.h5\")");
  }
  auto version = texts_of(file, "keras_version");
  if (version.empty()) version = texts_of(weights.get(), "keras_version");
  Piece texts;
  texts.text(config.front());
  texts.text(version.empty() ? "of unknown version" : version.front());
  RAVENCAL_RETURN_IF_ERROR(send(texts.bytes()));
  H5G_info_t about;
  if (H5Gget_info(weights.get(), &about) < 0 || about.nlinks > kMostNames)
    return core::data_error("has more layers than a model can have");
  for (hsize_t k = 0; k < about.nlinks; ++k) {
    std::vector<char> name(1024, '\0');
    if (H5Lget_name_by_idx(weights.get(), ".", H5_INDEX_NAME, H5_ITER_INC, k, name.data(),
                           name.size() - 1, H5P_DEFAULT) < 0) {
      return core::data_error("has a layer without a name");
    }
    RAVENCAL_RETURN_IF_ERROR(send_layer(weights.get(), name.data(), send));
  }
  return {};
}

core::Status send_content(const std::string& path, const core::TakePiece& send) {
  exchange::hdf5_quiet();
  const Hdf5Handle file = exchange::hdf5_open(path.c_str());
  if (!file.ok()) {
    return core::data_error(
        fmt::format("{}: is not an HDF5 file; save the model by model.save(\"model.h5\")", path));
  }
  if (!exchange::stands_alone(file))
    return core::data_error(fmt::format("{}: {}", path, exchange::kLiesElsewhere));
  const core::Status sent = send_opened(file.get(), send);
  return sent.ok() ? sent : core::data_error(fmt::format("{}: {}", path, sent.error().message));
}

core::Status take_weights(PieceReader piece, KerasContent& content) {
  const std::string layer = piece.text();
  const std::string name = piece.text();
  const std::uint64_t rows = piece.number();
  const std::uint64_t columns = piece.number();
  if (rows == 0 && columns == 0) {
    content.unreadable[layer][name] = piece.text();
    return {};
  }
  if (rows < 1 || rows > kMostWeights || columns < 1 || columns > kMostWeights ||
      piece.left() != rows * columns * sizeof(double)) {
    return core::data_error(fmt::format("weights '{}' are not whole", name));
  }
  RowMajor values(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns));
  piece.copy(values.data(), piece.left());
  content.weights[layer][name] = values;
  return {};
}

}  // namespace

core::Result<KerasContent> KerasContent::read(const std::string& path) {
  std::error_code failure;
  if (!std::filesystem::is_regular_file(path, failure)) {
    return core::Error{core::ErrorCode::kIo, fmt::format("{}: no such file", path)};
  }
  KerasContent content;
  bool has_texts = false;
  const auto take = [&](std::span<const std::uint8_t> piece) -> core::Status {
    if (has_texts) return take_weights(PieceReader(piece), content);
    PieceReader texts(piece);
    content.model_config = texts.text();
    content.version = texts.text();
    has_texts = true;
    return {};
  };
  const auto send = [&](const core::TakePiece& to) { return send_content(path, to); };
  RAVENCAL_RETURN_IF_ERROR(
      core::in_child(path, "read as HDF5", core::Isolation::reading(path), send, take));
  return content;
}

}  // namespace ravencal::conversion
