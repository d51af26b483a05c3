#pragma once
// Small inputs from the program's own writers: the start of fuzzing.

#include "classifier/imprint/imprint_model.hpp"
#include "classifier/live/staged_model.hpp"
#include "classifier/model/stored_model.hpp"
#include "classifier/vibro/recording_model.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "daemon/storage/recordings/recording_set.hpp"

namespace weft::fuzz {

/// Two trials of two taxels with every column filled.
daemon::Dataset sample_dataset();

/// Three recordings of two channels, each at its own rate.
daemon::RecordingSet sample_recordings();

/// Three fabrics, one taxel, phases P and M. `learner` is a single one, not `best`.
Result<classifier::StoredModel> sample_model(classifier::Learner learner, classifier::View view);

/// Three textures on an array of 6 x 8.
Result<classifier::imprint::ImprintModel> sample_imprint_model(classifier::Learner learner);

/// Two textures, one channel, windows of a tenth of a second.
Result<classifier::vibro::RecordingModel> sample_recording_model(classifier::Learner learner);

/// Two stages of three fabrics, one taxel, by LDA.
Result<classifier::StagedModel> sample_live_model();

}  // namespace weft::fuzz
