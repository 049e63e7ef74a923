// SPDX-License-Identifier: Apache-2.0
#include "rezero/weights.hpp"

#include <span>
#include <string>

#include "core/whole_file.hpp"
#include "model/blob_view.hpp"
#include "model/blob_writer.hpp"

namespace ravencal::rezero {

core::Result<Weights> load_weights(const std::filesystem::path& path) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::string text, core::read_whole_file(path));
  const std::span bytes(reinterpret_cast<const std::byte*>(text.data()), text.size());
  Weights weights;
  RAVENCAL_ASSIGN_OR_RETURN(weights.model, model::decode_blob(bytes, path.string()));
  model::BlobView view;  // decode_blob has opened it once
  if (model::BlobView::open(bytes, view).ok()) weights.checksum = view.checksum();
  return weights;
}

}  // namespace ravencal::rezero
