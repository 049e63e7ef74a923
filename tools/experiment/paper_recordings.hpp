// SPDX-License-Identifier: Apache-2.0
//
// The recordings of arXiv 2302.04999, made on the digital twin: zig-zags of five sparsities to
// train on and hours of random motion to test on, unloaded and with 500 g, and sets after 0 to 5
// homings. Every recording has a run seed of its own. Training and test of a load are homed apart;
// the homing sets follow the unloaded training in one session, as the question asks.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "physics/plant.hpp"

namespace ravencal::experiment {

struct PaperRecordingOptions {
  double test_s = 21600.0;  ///< of each load, in six recordings
  std::uint64_t seed = 1;   ///< run and homing seeds follow from it
  unsigned workers = 0;     ///< recordings at the same time; 0: one per core
};

/// Paths of the recordings.
struct PaperRecordings {
  std::vector<std::string> train, test, train_loaded, test_loaded;
  std::vector<std::string> train_rehomed;  ///< the zig-zags after different homings
  std::vector<std::string> test_homing;    ///< after 0 to 5 homings since `train`
  bool interrupted = false;
};

/// Makes those that are missing in a folder below `folder` whose name says all that they depend on.
/// `progress` gets the share done and returns false to stop; what is whole then stays.
/// Errors: kUsage for a plant that the twin cannot run, kIo.
core::Result<PaperRecordings> make_paper_recordings(const physics::Plant& plant,
                                                    const PaperRecordingOptions& options,
                                                    const std::filesystem::path& folder,
                                                    const std::function<bool(double)>& progress);

/// What is still to be made of them.
struct PaperWork {
  std::size_t recordings = 0;
  double motion_s = 0.0;
};
core::Result<PaperWork> missing_paper_recordings(const physics::Plant& plant,
                                                 const PaperRecordingOptions& options,
                                                 const std::filesystem::path& folder);

/// Two recordings of two seconds in the place of all: they have the twin's channels, which say what
/// networks a study has. Errors: as make_paper_recordings().
core::Result<PaperRecordings> make_stand_ins(const physics::Plant& plant,
                                             const std::filesystem::path& folder);
/// Rows of a zig-zag to train on, on the mean.
extern const std::uint64_t kRowsOfZigzag;

}  // namespace ravencal::experiment
