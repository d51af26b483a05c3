#pragma once
// The HTTP pages of a Net F/T box, as far as its driver needs them.

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
  std::optional<Error> missing;  ///< why the calibration page could not be read

  /// Of the calibration page, or as the settings page repeats it; empty where neither has it.
  [[nodiscard]] const std::string& calibration_serial() const {
    return calibration.serial.empty() ? settings.calibration_serial : calibration.serial;
  }
};

/// Reads the settings and calibration pages of a Net F/T box over its HTTP port, one after the
/// other on one link. Not every box has the second: that it is missing is no failure. `done` is
/// called once a read, never from read().
class PageReader {
 public:
  using Done = std::function<void(Result<BoxPages>)>;
  explicit PageReader(Done done) : done_(std::move(done)) {}
  ~PageReader() { let_go(); }
  PageReader(const PageReader&) = delete;
  PageReader& operator=(const PageReader&) = delete;

  /// Errors: io. `link` outlives the reading.
  Status read(Link& link);
  /// No callback comes any more.
  void let_go();
  [[nodiscard]] bool reading() const { return link_ != nullptr; }
  /// Ends a reading whose calibration page does not come; false where the settings are missing.
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
