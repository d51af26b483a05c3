#pragma once
// Selection and splits of windows: the paper's protocol, and two without leaks.

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/evaluate/splits.hpp"
#include "classifier/vibro/extract.hpp"

namespace weft::classifier::vibro {

enum class Protocol {
  random,  ///< the paper's: windows anywhere in a recording, 80 % of them train. A test window
           ///< shares most samples with training windows, so its accuracy is too high
  blocks,  ///< contiguous parts of every recording; each part tests once; no sample is shared
  groups   ///< whole recordings: each group tests once, or only the named ones test
};
std::string_view to_string(Protocol protocol);
Result<Protocol> protocol_from(std::string_view text);

struct ProtocolOptions {
  Protocol protocol = Protocol::blocks;
  double window_s = 2.0;
  double step_s = 0.25;             ///< blocks, groups: time between two windows
  std::size_t blocks = 5;           ///< 2 and more
  std::size_t per_recording = 100;  ///< random: number of windows per recording
  double test_share = 0.2;          ///< random: share of each recording's windows
  std::size_t repeats = 1;          ///< random: number of splits
  std::vector<std::string> train_groups =
      {};  ///< groups: training groups; empty: all that do not test
  std::vector<std::string> test_groups = {};  ///< groups: test groups; empty: each tests once
  std::uint64_t seed = 1;
  /// random: a recording drawn like that of another file, because it is a copy. Otherwise no window
  /// of one would be a window of the other.
  std::map<std::string, std::string> drawn_as = {};
};

/// Places of the windows of a recording under a protocol. Pure; `options` is copied.
PlacesOf places_of(const ProtocolOptions& options);

/// Splits of the windows of places_of(). Refuses fewer than two blocks, a share without training or
/// test windows, a test group without recordings, and no windows at all. Refuses a label without
/// training windows or, except for groups, without test windows. Each error has advice. A test
/// group may lack labels, as a recording may be missing.
Result<std::vector<Split>> split_windows(const WindowSet& windows, const ProtocolOptions& options);

/// Overlap of the test windows with the training. For each test window: the share of its samples
/// that are also in its nearest training window of the same recording, in the channel with the
/// largest share.
struct Leak {
  double median = 0.0;   ///< of the shares
  double largest = 0.0;  ///< 0: no sample of a test window is in a training window
  double windows = 0.0;  ///< share of the test windows that overlap a training window
};
Leak measure_leak(const WindowSet& windows, const std::vector<Split>& splits);

}  // namespace weft::classifier::vibro
