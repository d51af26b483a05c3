#pragma once
// Reader of the HTTP pages of a Net F/T box.

#include <functional>
#include <optional>
#include <string>

#include "drivers/api/driver.hpp"
#include "protocols/base/result.hpp"
#include "protocols/rdt/page.hpp"

namespace weft::drivers {

struct BoxPages {
  protocols::rdt::SettingsPage settings;
  protocols::rdt::CalibrationPage calibration;
  std::optional<Error> missing;  ///< reason if the calibration page could not be read

  /// Serial number from the calibration page, else from the settings page; empty if neither has it.
  [[nodiscard]] const std::string& calibration_serial() const {
    return calibration.serial.empty() ? settings.calibration_serial : calibration.serial;
  }
};

/// Reads the settings page, then the calibration page of a Net F/T box over one link to its HTTP
/// port. Some boxes have no calibration page, so its absence is no failure. `done` is called once
/// per read().
class PageReader {
 public:
  using Done = std::function<void(Result<BoxPages>)>;
  explicit PageReader(Done done) : done_(std::move(done)) {}
  ~PageReader() { let_go(); }
  PageReader(const PageReader&) = delete;
  PageReader& operator=(const PageReader&) = delete;

  /// Errors: io. `link` must outlive the reading.
  Status read(Link& link);
  /// Detaches from the link; no callback follows.
  void let_go();
  [[nodiscard]] bool reading() const { return link_ != nullptr; }
  /// Ends a reading without the calibration page; false if the settings page is missing too.
  bool go_without_calibration();

 private:
  Status send_request(std::string_view path);
  void received(ByteView bytes);
  void on_settings();
  void on_calibration();
  void fail_with(const Error& why);
  void finish(Result<BoxPages> outcome);

  Done done_;
  Link* link_ = nullptr;
  protocols::rdt::HttpReply reply_;
  bool at_calibration_ = false;
  BoxPages pages_;
};

}  // namespace weft::drivers
