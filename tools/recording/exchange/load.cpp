// SPDX-License-Identifier: Apache-2.0
#include "exchange/load.hpp"

#include "exchange/table_file.hpp"

namespace ravencal::exchange {

core::Result<record::Recording> load_recording(const std::filesystem::path& path,
                                               const record::LoadOptions& options) {
  if (path.extension() == ".csv" || !is_table(path)) return record::load_recording(path, options);
  RAVENCAL_ASSIGN_OR_RETURN(record::Profile profile, record::profile_for(path, options));
  RAVENCAL_ASSIGN_OR_RETURN(const record::Table table, read_table(path, options));
  RAVENCAL_ASSIGN_OR_RETURN(record::Recording recording,
                            record::load_table(table, std::move(profile), options));
  RAVENCAL_RETURN_IF_ERROR(record::cut_to(recording, options.range));
  return recording;
}

}  // namespace ravencal::exchange
