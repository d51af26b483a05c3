#pragma once
// How far a run is: a bar with the time left on a terminal, plain lines elsewhere.

#include <cstddef>
#include <iosfwd>
#include <string>

#include "daemon/campaign/campaign.hpp"

namespace weft::daemon::cli {

/// "[#########...........]" of `width` characters between the brackets; done > planned is full.
std::string bar(std::size_t done, std::size_t planned, std::size_t width);

/// Prints TrialProgress. On a terminal one line that is rewritten; otherwise a line for every 5 %
/// of the trials and for every trial that did not complete.
class ProgressPrinter {
 public:
  ProgressPrinter(std::ostream& out, bool terminal) : out_(&out), terminal_(terminal) {}
  void operator()(const TrialProgress& progress);
  /// Ends the rewritten line.
  void finish();

 private:
  void rewrite(const std::string& line);
  void step(const TrialProgress& progress, const std::string& line);

  std::ostream* out_;
  bool terminal_;
  std::size_t last_width_ = 0;
  std::size_t lines_ = 0;  ///< twentieths printed so far
};

}  // namespace weft::daemon::cli
