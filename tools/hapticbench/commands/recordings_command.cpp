// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <algorithm>

#include "tools/hapticbench/engine/measures.h"
#include "tools/hapticbench/engine/study.h"
#include "tools/hapticbench/recordings.h"

namespace hapticd::tools {
namespace {

struct RecordingsOptions {
  std::vector<std::string> laws = kProxyLawChoices;
  RestingSurfaceOptions surfaces;
  int passed_places = 10;  ///< of each session: with a free and with a pressing HIP
};

/// One law on one resting surface.
struct SurfaceRow {
  RestingSurface surface{};
  std::string law;
  double stiffness_n_per_m = 500;
  SurfaceError stroke{};  ///< two strokes, along row and column
  SurfaceError still{};
};

/// One law at the positions in front of which something passes.
struct PassingRow {
  std::string law;
  int places = 0;
  double nearest_m = 0;  ///< of the positions
  double farthest_m = 0;
  PassingError free{};      ///< 30 mm in front of the surfaces
  PassingError pressing{};  ///< 6 mm behind them
};

/// The figures of a session.
struct SessionResult {
  std::string session;
  std::size_t frames = 0;
  rt::DepthModelParameters camera{};  ///< that recorded it
  double disparity_unit_m = 0;        ///< one of its raw disparities at 1 m
  std::vector<SurfaceRow> surfaces{};
  std::vector<PassingRow> passings{};
};

constexpr double kFreeBefore_m = 0.03;
constexpr double kPressingBefore_m = -0.006;

SurfaceRow measureSurface(const std::string& law, const BenchSequence& session, const RestingSurface& surface,
                          const CameraDisparity& camera) {
  SurfaceRow row{.surface = surface, .law = law};
  row.stiffness_n_per_m =
      shippedParameters(law, surface.distance_m, session.camera()).force.stiffness_n_per_m;
  row.stroke = handleWith(law, session, surface, camera, Handling::along_row);
  row.stroke.add(handleWith(law, session, surface, camera, Handling::along_column));
  row.still = handleWith(law, session, surface, camera, Handling::still);
  return row;
}

PassingRow measurePassing(const std::string& law, const BenchSequence& session,
                          const std::vector<PassedPlace>& places, const CameraDisparity& camera) {
  PassingRow row{.law = law};
  for (const PassedPlace& place : places) {
    row.nearest_m = row.places == 0 ? place.distance_m : std::min(row.nearest_m, place.distance_m);
    row.farthest_m = std::max(row.farthest_m, place.distance_m);
    ++row.places;
    row.free.add(passPlace(law, session, place, camera, kFreeBefore_m));
    row.pressing.add(passPlace(law, session, place, camera, kPressingBefore_m));
  }
  return row;
}

SessionResult measureSession(const BenchSequence& session, const RecordingsOptions& options) {
  SessionResult result{.session = session.name, .frames = session.frames.size(), .camera = session.camera()};
  showProgress(fmt::format("{}: resting surfaces", session.name));
  const CameraDisparity camera(cameraWithNoise(session));
  result.disparity_unit_m = camera.unit_m(1);
  const std::vector<PixelStatistics> pixels = pixelStatistics(session, camera);
  const auto surfaces = restingSurfaces(pixels, session.frames.size(), camera, options.surfaces);
  const auto places =
      passedPlaces(session, restingBackground(session, pixels, camera), camera, options.passed_places);
  for (const std::string& law : options.laws) {
    for (const RestingSurface& surface : surfaces) {
      showProgress(fmt::format("{}: {} on {:.2f} m at {:.2f} m", session.name, law, surface.size_m,
                               surface.distance_m));
      result.surfaces.push_back(measureSurface(law, session, surface, camera));
    }
    showProgress(fmt::format("{}: {} while something passes", session.name, law));
    if (!places.empty()) result.passings.push_back(measurePassing(law, session, places, camera));
  }
  return result;
}

constexpr const char* kExplanation =
    "Resting surfaces, known by a robust quadratic in disparity through the mean of the whole session:\n"
    "the hand presses 8 mm deep and strokes up to 100 mm at 0.1 m/s, along row and column, or stays for\n"
    "two seconds. raw: residual of the mean image about the fit, raw disparities. fit N: standard error of\n"
    "the fit itself, times k_s; an error below it has no meaning. lost: ticks with less than a tenth of\n"
    "the true force; zero: with none. along: force along the stroke, RMS. step: change of the law's force\n"
    "at a new frame while the HIP is still, before any blend.\n\n";

constexpr const char* kPassingExplanation =
    "\nPositions on resting surfaces in front of which something passes; the session is played forwards and\n"
    "backwards. free: a HIP 30 mm in front; force above 0.1 N, of all ticks and of those while something\n"
    "passes. pressing: a HIP 6 mm deep; the longest time above 0.5 N while something passes, of the error\n"
    "and of the change from the mean while nothing passes; calm: of that change while nothing passes, the\n"
    "sensor's own noise. left out: ticks with something measured within 20 mm of the HIP.\n\n";

constexpr double kFlatSize_m = 0.16;

/// The surfaces of one law together, as a Kinect v1 recorded them: the limits are of its noise.
struct PooledSurfaces {
  int surfaces = 0;
  SurfaceError stroke{};
  SurfaceError still{};
};

/// A limit on the surfaces of a range of distances and at least a size.
struct SurfaceLimit {
  const char* text;
  double from_m, to_m, least_size_m, limit;
  double (*figure)(const PooledSurfaces&);
};

PooledSurfaces pooled(std::span<const SessionResult> sessions, const std::string& law,
                      const SurfaceLimit& limit) {
  PooledSurfaces result;
  for (const SessionResult& session : sessions) {
    if (!isKinect(session.camera)) continue;
    for (const SurfaceRow& row : session.surfaces) {
      const RestingSurface& surface = row.surface;
      const bool belongs = row.law == law && surface.distance_m >= limit.from_m &&
                           surface.distance_m < limit.to_m && surface.size_m >= limit.least_size_m;
      if (!belongs) continue;
      ++result.surfaces;
      result.stroke.add(row.stroke);
      result.still.add(row.still);
    }
  }
  return result;
}

double lostPercent(const SurfaceError& error) {
  return percentOf(error.lost, error.error_n.size());
}

double jnd(const SurfaceError& error) {
  return rootMeanSquare(error.error_n) / justNoticeableDifference_n(error.largest_true_n);
}

/// The figures of a stroke or of a still hand, as members of the object at `key`.
void addErrors(Columns<SurfaceRow>& columns, const std::string& key, SurfaceError SurfaceRow::*error,
               bool stroke) {
  const auto add = [&](const char* name, bool shown, const char* heading, int decimals, auto figure) {
    columns.push_back({key + name, shown ? heading : "", decimals,
                       [error, figure](const SurfaceRow& row) -> Json { return figure(row.*error); }});
  };
  using E = SurfaceError;
  add("/ticks", false, "", 0, [](const E& e) { return e.error_n.size(); });
  add("/rms_n", true, stroke ? "rms N" : "still N", 2, [](const E& e) { return rootMeanSquare(e.error_n); });
  add("/jnd", true, "JND", 2, jnd);
  add("/lost_percent", true, "lost %", 1, lostPercent);
  add("/zero_percent", stroke, "zero %", 1, [](const E& e) { return percentOf(e.zero, e.error_n.size()); });
  add("/along_rms_n", stroke, "along N", 2, [](const E& e) { return rootMeanSquare(e.along_n); });
  add("/new_frames", false, "", 0, [](const E& e) { return e.new_frame_n.size(); });
  add("/step_median_n", !stroke, "step N", 3, [](const E& e) { return quantile(e.new_frame_n, 0.5); });
  add("/step_p99_n", !stroke, "99 %", 3, [](const E& e) { return quantile(e.new_frame_n, 0.99); });
}

Columns<SurfaceRow> surfaceColumns() {
  using Row = SurfaceRow;
  Columns<Row> columns{
      {"/law", "law", 0, &Row::law},
      {"/size_m", "size m", 2, [](const Row& r) { return r.surface.size_m; }},
      {"/distance_m", "at m", 2, [](const Row& r) { return r.surface.distance_m; }},
      {"/column", "column", 0, [](const Row& r) { return r.surface.column; }},
      {"/row", "row", 0, [](const Row& r) { return r.surface.row; }},
      {"/residual_raw", "raw", 2, [](const Row& r) { return r.surface.residual_raw; }},
      {"/fit_error_n", "fit N", 2, [](const Row& r) { return r.stiffness_n_per_m * r.surface.fit_error_m; }}};
  addErrors(columns, "/stroke", &Row::stroke, true);
  addErrors(columns, "/still", &Row::still, false);
  return columns;
}

/// The figures of a series above a limit, whose members are in the object at `key`.
void addExceedance(Columns<PassingRow>& columns, const std::string& key, const char* largest,
                   const char* percent, const char* longest, PassingError PassingRow::*error,
                   Exceedance PassingError::*series) {
  const auto add = [&](const char* name, const char* heading, int decimals, auto figure) {
    columns.push_back({key + name, heading, decimals, [error, series, figure](const PassingRow& r) -> Json {
                         return figure(r.*error.*series);
                       }});
  };
  add("/ticks", "", 0, [](const Exceedance& e) { return e.ticks; });
  add("/above_percent", percent, 2, [](const Exceedance& e) { return e.percent(); });
  add("/longest_ms", longest, 0, [](const Exceedance& e) { return e.longest; });
  add("/largest_n", largest, 3, [](const Exceedance& e) { return e.largest; });
}

Columns<PassingRow> passingColumns() {
  using Row = PassingRow;
  Columns<Row> columns{{"/law", "law", 0, &Row::law},
                       {"/places", "positions", 0, &Row::places},
                       {"/nearest_m", "from m", 2, &Row::nearest_m},
                       {"/farthest_m", "to m", 2, &Row::farthest_m}};
  addExceedance(columns, "/free", "free N", "% >0.1", "ms", &Row::free, &PassingError::ghost);
  addExceedance(columns, "/free_passed", "", "% passed", "", &Row::free, &PassingError::ghost_covered);
  columns.push_back({"/free_left_out", "left out", 0, [](const Row& r) { return r.free.left_out; }});
  addExceedance(columns, "/pressing_error", "press N", "", "ms >0.5", &Row::pressing, &PassingError::error);
  addExceedance(columns, "/pressing_change", "change N", "", "ms >0.5", &Row::pressing,
                &PassingError::change);
  addExceedance(columns, "/pressing_calm", "", "", "calm ms", &Row::pressing, &PassingError::calm);
  columns.push_back({"/pressing_left_out", "left out", 0, [](const Row& r) { return r.pressing.left_out; }});
  return columns;
}

void addPassing(std::span<const SessionResult> sessions, const std::string& law,
                std::vector<Requirement>& list) {
  PassingError free, pressing;
  for (const SessionResult& session : sessions) {
    if (!isKinect(session.camera)) continue;
    for (const PassingRow& row : session.passings) {
      if (row.law != law) continue;
      free.add(row.free);
      pressing.add(row.pressing);
    }
  }
  if (free.ghost.ticks == 0) {
    list.push_back(Requirement::notMeasured(law, "force on a free HIP that something passes, N"));
    return;
  }
  const auto add = [&](const std::string& text, double limit, double figure) {
    list.push_back(Requirement::atMost(law, text, limit, figure));
  };
  add("force on a HIP 30 mm in front of resting surfaces while people pass, N", 0.1, free.ghost.largest);
  add("the same, ticks above 0.1 N, %", 0, free.ghost.percent());
  add("error of a pressing HIP above 0.5 N while something passes, longest, ms", 100,
      static_cast<double>(pressing.error.longest));
  add(fmt::format("the same as a change; while nothing passes up to {}, ms", pressing.calm.longest), 100,
      static_cast<double>(pressing.change.longest));
}

double stepP99_n(const PooledSurfaces& surfaces) {
  return quantile(surfaces.still.new_frame_n, 0.99);
}

double strokeLost_percent(const PooledSurfaces& surfaces) {
  return lostPercent(surfaces.stroke);
}

double stroke_jnd(const PooledSurfaces& surfaces) {
  return rootMeanSquare(surfaces.stroke.error_n) / justNoticeableDifference_n(surfaces.still.largest_true_n);
}

constexpr SurfaceLimit kSurfaceLimits[] = {
    {"contact lost in strokes on flat surfaces of 160 mm, to 2 m, %", 0, 2, kFlatSize_m, 0,
     strokeLost_percent},
    {"contact lost in strokes on flat surfaces of 160 mm, 2 to 3 m, %", 2, 3.05, kFlatSize_m, 5,
     strokeLost_percent},
    {"RMS error in strokes on flat surfaces of 160 mm, to 1.2 m, JND", 0, 1.2, kFlatSize_m, 1, stroke_jnd},
    {"change of the force at a new frame, HIP still, 99 of 100, to 1.2 m, N", 0, 1.2, 0, 0.05, stepP99_n},
    {"change of the force at a new frame, HIP still, 99 of 100, 1.2 to 2.7 m, N", 1.2, 2.75, 0, 0.2,
     stepP99_n}};

std::vector<Requirement> requirementsOf(std::span<const SessionResult> sessions,
                                        const RecordingsOptions& options) {
  std::vector<Requirement> list;
  for (const std::string& law : options.laws) {
    addPassing(sessions, law, list);
    for (const SurfaceLimit& limit : kSurfaceLimits) {
      const PooledSurfaces surfaces = pooled(sessions, law, limit);
      list.push_back(surfaces.surfaces == 0
                         ? Requirement::notMeasured(law, limit.text)
                         : Requirement::atMost(law, limit.text, limit.limit, limit.figure(surfaces)));
    }
  }
  return list;
}

std::string titleOf(const SessionResult& session) {
  if (isKinect(session.camera)) return session.session;
  return fmt::format("{}, {} x {} pixels, raw disparities of {:.2f} mm at 1 m", session.session,
                     session.camera.width_px, session.camera.height_px, 1000 * session.disparity_unit_m);
}

Report recordingsReport(std::span<const SessionResult> sessions, const RecordingsOptions& options) {
  Report report;
  Json document = Json::array();
  report.say(kExplanation);
  for (const SessionResult& session : sessions) {
    report.show(titleOf(session), titleOf(session) + "\n", surfaceColumns(), session.surfaces);
    report.say("\n");
    document.push_back({{"session", session.session},
                        {"frames", session.frames},
                        {"camera",
                         {{"width_px", session.camera.width_px},
                          {"height_px", session.camera.height_px},
                          {"principle", rt::wordOf(session.camera.principle)},
                          {"disparity_unit_m_at_1_m", session.disparity_unit_m}}},
                        {"surfaces", tableJson(surfaceColumns(), session.surfaces)},
                        {"passings", tableJson(passingColumns(), session.passings)}});
  }
  report.note("sessions", std::move(document));
  report.say(kPassingExplanation);
  for (const SessionResult& session : sessions) {
    report.show(session.session, session.session + "\n", passingColumns(), session.passings);
  }
  report.requirements(requirementsOf(sessions, options));
  return report;
}

struct Chosen {
  RecordingsOptions options;
  std::string recordings;
  std::size_t most_frames = 300;
};

int runRecordings(const Chosen& chosen, const StudyCommand& command) {
  const auto sessions = recordedSequences(chosen.recordings, chosen.most_frames);
  if (!sessions) return fail(sessions.error(), EX_NOINPUT);
  if (sessions->empty()) {
    return fail({chosen.recordings, "holds no recordings",
                 "name a folder whose subfolders are recordings with --recordings"},
                EX_NOINPUT);
  }
  std::vector<SessionResult> results;
  for (const BenchSequence& session : *sessions) {
    if (session.frames.size() >= 2) results.push_back(measureSession(session, chosen.options));
  }
  return command.report(recordingsReport(results, chosen.options));
}

}  // namespace

StudyCommand recordingsCommand(CLI::App& app) {
  const auto chosen = std::make_shared<Chosen>();
  RecordingsOptions& options = chosen->options;
  StudyCommand command(
      app, "recordings",
      "forces on the resting surfaces of recordings, and while people pass in front of them");
  command.quick("one size, one surface per class of distances, two positions that are passed", [&options] {
    options.surfaces.sizes_m = {0.32};
    options.surfaces.most_per_class = 1;
    options.passed_places = 2;
  });
  command.recordings(chosen->recordings);
  command.names("--laws", options.laws, kProxyLawChoices, "all");
  command->add_option("--frames", chosen->most_frames, "frames read of each recording (300)")
      ->check(within(std::size_t{2}, std::size_t{100000}));
  command.onRun([chosen](const StudyCommand& self) { return runRecordings(*chosen, self); });
  return command;
}

}  // namespace hapticd::tools
