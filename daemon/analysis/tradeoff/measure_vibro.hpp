#pragma once
// `weft tradeoff vibro`: learner x features x window x source on recordings of sound and vibration,
// under the paper's protocol and an honest one; the paper's tables; and what `weft vibro evaluate`
// found on such recordings, as one page.

#include <string>
#include <utility>
#include <vector>

#include "classifier/vibro/cross_validation.hpp"
#include "daemon/analysis/tradeoff/measure_classifier.hpp"
#include "daemon/analysis/tradeoff/tradeoff.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "daemon/storage/recordings/recording_set.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

struct VibroTradeoffOptions {
  std::vector<classifier::Learner> learners = classifier::vibro::window_learners();
  std::vector<classifier::vibro::Family> families = {classifier::vibro::Family::smmrp,
                                                     classifier::vibro::Family::fft,
                                                     classifier::vibro::Family::smmrpfft};
  std::vector<double> windows_s = {1.0, 2.0};
  std::vector<std::string> sources = {};  ///< of list_sources(); empty: all
  /// What leaves whole parts out beside the paper's random windows: blocks or groups.
  classifier::vibro::Protocol honest = classifier::vibro::Protocol::blocks;
  classifier::vibro::Combine combine = classifier::vibro::Combine::mean;
  std::size_t components = classifier::vibro::papers_components;
  /// Its window and protocol are set for each choice.
  classifier::vibro::ProtocolOptions protocol;
  classifier::TrainOptions training;  ///< `stop` is asked before each training
  std::size_t timings = 101;          ///< of the features of a window, at least 5
};

/// One choice and what came of it.
struct VibroPoint {
  classifier::Learner learner{};
  classifier::vibro::Family family{};
  double window_s = 0.0;
  std::string source;  ///< "S", "XYZ", "SXYZ"
  classifier::vibro::Protocol protocol{};
  classifier::vibro::CrossValidation result;
  double features_s = 0.0;  ///< of one window, one thread
};

/// Recordings of which windows of one length under one protocol left nothing, of any source.
struct VibroTooShort {
  classifier::vibro::Protocol protocol{};
  double window_s = 0.0;
  std::size_t parts = 1;  ///< of a recording, into each of which a window must fit
  std::vector<classifier::vibro::TooShort> recordings;
};

struct VibroTradeoff {
  std::vector<VibroPoint> points;
  classifier::vibro::Protocol honest = classifier::vibro::Protocol::blocks;
  /// Of random windows, and of the honest protocol: of all choices the one with the largest median.
  classifier::vibro::Leak random_leak, honest_leak;
  std::vector<std::string> left_out;  ///< learners that this build has no library for
  std::vector<VibroTooShort> too_short;
  bool papers_recipe = false;  ///< is_papers_recipe() of its random windows
};

/// "S", "XYZ" and both where the recordings have sound and something else; else the one there is.
std::vector<std::string> list_sources(const RecordingSet& set);
/// The recordings with the channels of that source alone.
std::vector<classifier::vibro::Recording> of_source(const RecordingSet& set,
                                                    const std::string& source);

/// "random windows", "contiguous parts", "whole recordings".
std::string protocol_name(classifier::vibro::Protocol protocol);

/// Seconds that the features of one window take on this thread: the median over `timings` windows
/// of `windows`, which were cut from `recordings`, a first one not counted. Refuses what extraction
/// refuses.
Result<double> vibro_features_time(const std::vector<classifier::vibro::Recording>& recordings,
                                   const classifier::vibro::WindowSet& windows,
                                   classifier::vibro::FeatureChoice choice, std::size_t timings,
                                   const classifier::SecondsNow& now);

/// What can be known before anything is trained: fewer than 5 timings, what check() refuses of the
/// set, and every window and protocol whose places, with all channels, do not give splits or cannot
/// be cut, by the window.
Status check_vibro_tradeoff(const RecordingSet& set, const VibroTradeoffOptions& options);

/// All choices under both protocols. Refuses what check_vibro_tradeoff(), extraction and training
/// refuse.
Result<VibroTradeoff> measure_vibro_tradeoff(const RecordingSet& set,
                                             const VibroTradeoffOptions& options,
                                             const classifier::SecondsNow& seconds_now,
                                             const TradeoffProgress& progress = {});

/// What a learner reached as a point of the trade's page: accuracy is the macro F-score. Without
/// settings and seconds of contact; the family is the name.
TradeoffPoint vibro_tradeoff_point(BenchKind bench, std::string name,
                                   const classifier::vibro::CrossValidation& result,
                                   double features_s);

/// The choices of one protocol as a set of the trade's page: accuracy is the macro F-score. `file`:
/// how the recordings were named.
TradeoffSet vibro_tradeoff_set(const VibroTradeoff& tradeoff, const RecordingSet& set,
                               const std::string& file, classifier::vibro::Protocol protocol);

/// Table 1 (F-score for windows of 1 s and 2 s; rows of features that were measured), the averages
/// over its learners, and those behind Figure 4, each cell: ours on random windows, ours on what is
/// left out whole. Then Table 2: the share of right answers for each material over all learners,
/// and what it is taken for. Of the source with most channels. The paper's figures stand beside
/// where its recipe was run. `badge_html`: of the bench, on every table.
Blocks vibro_tables(const VibroTradeoff& tradeoff, const std::string& badge_html);

/// One learner, or the choice among several.
struct WindowLearner {
  std::string name;  ///< "knn", "best"
  classifier::vibro::CrossValidation result;
};

/// Intervals of the learners are shown as they are named.
struct VibroEvaluation {
  BenchKind bench = BenchKind::unknown;
  std::string dataset, sha256;
  std::vector<std::pair<std::string, std::string>> facts;  ///< name and value, plain text
  double window_s = 0, features_s = 0;                     ///< features_s: of one window, measured
  std::vector<WindowLearner> learners;
  std::string importance;  ///< plain text; may be empty
};

/// Accuracy of recordings and windows with intervals, confusion by material of each learner, macro
/// F-score against the time of an answer; every figure bears the bench's word. Refuses no learners
/// and figures that are not finite.
Result<Document> vibro_document(const VibroEvaluation& evaluation);

}  // namespace weft::daemon
