#pragma once
// How windows are taken from recordings and split: the paper's way, and two honest ones.

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
           ///< shares most of its samples with training windows: its figures are too good
  blocks,  ///< contiguous parts of every recording, each left out in turn: no sample is shared
  groups   ///< whole recordings: each group left out in turn, or the named ones test
};
std::string_view to_string(Protocol protocol);
Result<Protocol> protocol_from(std::string_view text);

struct ProtocolOptions {
  Protocol protocol = Protocol::blocks;
  double window_s = 2.0;
  double step_s = 0.25;                        ///< blocks, groups: from one window to the next
  std::size_t blocks = 5;                      ///< 2 and more
  std::size_t per_recording = 100;             ///< random: windows of each recording
  double test_share = 0.2;                     ///< random: of each recording's windows
  std::size_t repeats = 1;                     ///< random: splits
  std::vector<std::string> train_groups = {};  ///< groups; empty: all that do not test
  std::vector<std::string> test_groups = {};   ///< groups; empty as well: each in turn
  std::uint64_t seed = 1;
  /// random: recordings that are drawn from as that of another file is, as they are copies of it:
  /// else no window of one would be one of the other.
  std::map<std::string, std::string> drawn_as = {};
};

/// Where the windows of a recording lie under a protocol. Pure; `options` is copied.
PlacesOf places_of(const ProtocolOptions& options);

/// Splits of the windows that places_of() gave. Refuses fewer than two blocks, a share that leaves
/// nothing to train or test, a test group that no recording has, a label without training windows,
/// or, but for groups, without test windows, and no windows at all (each with what to change). A
/// group that is left out may lack labels, as a recording may be missing.
Result<std::vector<Split>> split_windows(const WindowSet& windows, const ProtocolOptions& options);

/// How much of the test windows the training has seen. Of each, the share of its samples that its
/// nearest training window of the same recording has too, in the channel with the largest share.
struct Leak {
  double median = 0.0;   ///< of the shares
  double largest = 0.0;  ///< 0: no sample of a test window is in a training window
  double windows = 0.0;  ///< share of the test windows of which anything was seen
};
Leak measure_leak(const WindowSet& windows, const std::vector<Split>& splits);

}  // namespace weft::classifier::vibro
