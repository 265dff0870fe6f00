// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sysexits.h>

#include <algorithm>

#include "tools/hapticbench/engine/study.h"
#include "tools/hapticbench/recordings.h"

namespace hapticd::tools {
namespace {

struct RecordingsOptions {
  std::vector<std::string> laws = kProxyLawChoices;
  RestingSurfaceOptions surfaces;
  int passed_places = 10;  ///< of each session: with a free and with a pressing HIP
  std::string recordings;
  std::size_t most_frames = 300;
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

constexpr const char* kRecordingsExplanation =
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
Row errorCells(const std::string& key, const SurfaceError& error, bool stroke) {
  const auto shown = [](bool is_shown, const char* heading) { return is_shown ? heading : ""; };
  return {{key + "/ticks", "", 0, error.error_n.size()},
          {key + "/rms_n", stroke ? "rms N" : "still N", 2, rootMeanSquare(error.error_n)},
          {key + "/jnd", "JND", 2, jnd(error)},
          {key + "/lost_percent", "lost %", 1, lostPercent(error)},
          {key + "/zero_percent", shown(stroke, "zero %"), 1, percentOf(error.zero, error.error_n.size())},
          {key + "/along_rms_n", shown(stroke, "along N"), 2, rootMeanSquare(error.along_n)},
          {key + "/new_frames", "", 0, error.new_frame_n.size()},
          {key + "/step_median_n", shown(!stroke, "step N"), 3, quantile(error.new_frame_n, 0.5)},
          {key + "/step_p99_n", shown(!stroke, "99 %"), 3, quantile(error.new_frame_n, 0.99)}};
}

Row surfaceCells(const SurfaceRow& r) {
  Row row{{"/law", "law", 0, r.law},
          {"/size_m", "size m", 2, r.surface.size_m},
          {"/distance_m", "at m", 2, r.surface.distance_m},
          {"/column", "column", 0, r.surface.column},
          {"/row", "row", 0, r.surface.row},
          {"/residual_raw", "raw", 2, r.surface.residual_raw},
          {"/fit_error_n", "fit N", 2, r.stiffness_n_per_m * r.surface.fit_error_m}};
  return joined(joined(std::move(row), errorCells("/stroke", r.stroke, true)),
                errorCells("/still", r.still, false));
}

/// The figures of a series above a limit, whose members are in the object at `key`.
Row exceedanceCells(const std::string& key, const char* largest, const char* percent, const char* longest,
                    const Exceedance& series) {
  return {{key + "/ticks", "", 0, series.ticks},
          {key + "/above_percent", percent, 2, series.percent()},
          {key + "/longest_ms", longest, 0, series.longest},
          {key + "/largest_n", largest, 3, series.largest}};
}

Row passingCells(const PassingRow& r) {
  Row row{{"/law", "law", 0, r.law},
          {"/places", "positions", 0, r.places},
          {"/nearest_m", "from m", 2, r.nearest_m},
          {"/farthest_m", "to m", 2, r.farthest_m}};
  for (const Row& more : {exceedanceCells("/free", "free N", "% >0.1", "ms", r.free.ghost),
                          exceedanceCells("/free_passed", "", "% passed", "", r.free.ghost_covered),
                          Row{{"/free_left_out", "left out", 0, r.free.left_out}},
                          exceedanceCells("/pressing_error", "press N", "", "ms >0.5", r.pressing.error),
                          exceedanceCells("/pressing_change", "change N", "", "ms >0.5", r.pressing.change),
                          exceedanceCells("/pressing_calm", "", "", "calm ms", r.pressing.calm),
                          Row{{"/pressing_left_out", "left out", 0, r.pressing.left_out}}})
    row = joined(std::move(row), more);
  return row;
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

constexpr SurfaceLimit kSurfaceLimits[] = {
    {"contact lost in strokes on flat surfaces of 160 mm, to 2 m, %", 0, 2, kFlatSize_m, 0,
     [](const PooledSurfaces& s) { return lostPercent(s.stroke); }},
    {"contact lost in strokes on flat surfaces of 160 mm, 2 to 3 m, %", 2, 3.05, kFlatSize_m, 5,
     [](const PooledSurfaces& s) { return lostPercent(s.stroke); }},
    {"RMS error in strokes on flat surfaces of 160 mm, to 1.2 m, JND", 0, 1.2, kFlatSize_m, 1,
     [](const PooledSurfaces& s) {
       return rootMeanSquare(s.stroke.error_n) / justNoticeableDifference_n(s.still.largest_true_n);
     }},
    {"change of the force at a new frame, HIP still, 99 of 100, to 1.2 m, N", 0, 1.2, 0, 0.05,
     [](const PooledSurfaces& s) { return quantile(s.still.new_frame_n, 0.99); }},
    {"change of the force at a new frame, HIP still, 99 of 100, 1.2 to 2.7 m, N", 1.2, 2.75, 0, 0.2,
     [](const PooledSurfaces& s) { return quantile(s.still.new_frame_n, 0.99); }}};

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
  report.say(kRecordingsExplanation);
  report.note("/sessions", std::vector<Row>());
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    const SessionResult& session = sessions[i];
    const std::string at = fmt::format("/sessions/{}", i);
    const std::vector<Row> surfaces = rowsOf(session.surfaces, surfaceCells);
    report.show(titleOf(session), titleOf(session) + "\n", surfaces);
    report.say("\n");
    report.note(at + "/session", session.session);
    report.note(at + "/frames", session.frames);
    report.note(at + "/camera/width_px", session.camera.width_px);
    report.note(at + "/camera/height_px", session.camera.height_px);
    report.note(at + "/camera/principle", rt::wordOf(session.camera.principle));
    report.note(at + "/camera/disparity_unit_m_at_1_m", session.disparity_unit_m);
    report.note(at + "/surfaces", surfaces);
    report.note(at + "/passings", rowsOf(session.passings, passingCells));
  }
  report.say(kPassingExplanation);
  for (const SessionResult& session : sessions)
    report.show(session.session, session.session + "\n", rowsOf(session.passings, passingCells));
  report.requirements(requirementsOf(sessions, options));
  return report;
}

int runRecordings(const RecordingsOptions& options, const StudyCommand& command) {
  const auto sessions = recordedSequences(options.recordings, options.most_frames);
  if (!sessions) return fail(sessions.error(), EX_NOINPUT);
  if (sessions->empty()) {
    return fail({options.recordings, "holds no recordings",
                 "name a folder whose subfolders are recordings with --recordings"},
                EX_NOINPUT);
  }
  std::vector<SessionResult> results;
  for (const BenchSequence& session : *sessions) {
    if (session.frames.size() >= 2) results.push_back(measureSession(session, options));
  }
  return command.report(recordingsReport(results, options));
}

}  // namespace

StudyCommand recordingsCommand(CLI::App& app) {
  const auto chosen = std::make_shared<RecordingsOptions>();
  RecordingsOptions& options = *chosen;
  StudyCommand command(
      app, "recordings",
      "forces on the resting surfaces of recordings, and while people pass in front of them");
  command.quick("one size, one surface per class of distances, two positions that are passed", [&options] {
    options.surfaces.sizes_m = {0.32};
    options.surfaces.most_per_class = 1;
    options.passed_places = 2;
  });
  command.recordings(options.recordings);
  command.names("--laws", options.laws, kProxyLawChoices, "all");
  command.number("--frames", options.most_frames, std::size_t{2}, std::size_t{100000},
                 "frames read of each recording (300)");
  command.onRun([chosen](const StudyCommand& self) { return runRecordings(*chosen, self); });
  return command;
}

}  // namespace hapticd::tools
