// SPDX-License-Identifier: Apache-2.0
// Looks at a running hapticd-view by a client of the Foxglove protocol that is not of this project:
// `look.mjs URL FILE`. Subscribes to every channel, decodes several messages of each by the schema that the server
// advertises, checks what must be in them, and writes the ticks to FILE for compare.mjs.
// Exit status: 0 all is well, 1 something is not, and what.

import assert from "node:assert/strict";
import { writeFile } from "node:fs/promises";
import { ros2jazzy } from "@foxglove/rosmsg-msgs-common";
import protocol from "@foxglove/ws-protocol";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import WebSocket from "ws";

const [url, file] = process.argv.slice(2);

/** Messages of each channel that are decoded. */
const PER_CHANNEL = 5;
/** Only a failing test waits this long. */
const PATIENCE_MS = 60_000;

const bytesOf = (data) => new Uint8Array(data.buffer, data.byteOffset, data.byteLength);

/** The name that the server chooses of those offered; "400" when it refuses with that status. */
function chosen(offered) {
  return new Promise((resolve, reject) => {
    const socket = new WebSocket(url, offered);
    socket.on("open", () => (resolve(socket.protocol), socket.close()));
    socket.on("unexpected-response", (_request, response) => (resolve(String(response.statusCode)), socket.terminate()));
    socket.on("error", reject);
  });
}

/** Name and type of each field, without constants. */
const fieldsOf = (definitions) =>
  definitions.filter(({ isConstant }) => isConstant !== true).map(({ name, type, isArray, arrayLength }) => ({ name, type, isArray: isArray === true, arrayLength }));

/** A schema of ROS 2 must have the fields that ROS 2 has published, of each type. */
function compareWithPublished(schemaName, schema) {
  for (const { name, definitions } of parse(schema, { ros2: true })) {
    const published = ros2jazzy[name ?? schemaName.replace("/msg/", "/")];
    if (name?.startsWith("builtin_interfaces/")) continue;
    assert.deepEqual(fieldsOf(definitions), fieldsOf(published.definitions), name ?? schemaName);
  }
}

/** x, y and z of each point. */
function pointsOf(cloud) {
  assert.deepEqual([cloud.header.frame_id, cloud.point_step, cloud.row_step], ["camera_optical", 12, cloud.data.byteLength]);
  assert.deepEqual(cloud.fields.map(({ name, offset, datatype }) => [name, offset, datatype]), [["x", 0, 7], ["y", 4, 7], ["z", 8, 7]]);
  const view = new DataView(cloud.data.buffer, cloud.data.byteOffset, cloud.data.byteLength);
  return Array.from({ length: cloud.width }, (_, i) => [0, 4, 8].map((at) => view.getFloat32(12 * i + at, true)));
}

/** The arrow of the force, where there is one. */
const arrowOf = ({ markers }) => markers.find(({ ns, id, action }) => ns === "force" && id === 0 && action === 0);

/** What the messages of each topic must be; the box looks at a wall 1 m away, and the hand is in contact with it. */
const checks = {
  "/hapticd/tick": (ticks) => {
    ticks.forEach((tick, i) => assert.ok(i === 0 || tick.number > ticks[i - 1].number));
  },
  "/hapticd/scene": (scenes, parameters) => {
    for (const { markers } of scenes) {
      assert.deepEqual(markers.map(({ ns, id }) => `${ns} ${id}`), ["hip 0", "proxy 0", "reach 0", "force 0", "force 1"]);
      for (const { header } of markers) assert.equal(header.frame_id, "world");
      const [hip, proxy] = markers;
      const radius = parameters.get(proxy.action === 0 ? "contact.proxy_radius_m" : "force.radius_m");
      assert.deepEqual([hip.type, hip.scale], [2, { x: 2 * radius, y: 2 * radius, z: 2 * radius }]);
    }
    const { points: [tail, tip], scale } = scenes.map(arrowOf).filter((arrow) => arrow !== undefined).at(-1);
    assert.ok(Math.hypot(tip.x - tail.x, tip.y - tail.y, tip.z - tail.z) >= scale.z && scale.z > 0);
  },
  "/hapticd/transforms": (messages) => {
    for (const { transforms } of messages) {
      assert.deepEqual(transforms.map(({ header, child_frame_id }) => [header.frame_id, child_frame_id]),
        [["world", "camera"], ["camera", "camera_optical"]]);
      for (const { transform: { rotation: q } } of transforms) assert.ok(Math.abs(Math.hypot(q.x, q.y, q.z, q.w) - 1) < 1e-12);
    }
  },
  "/hapticd/cloud": (clouds) => {
    const points = pointsOf(clouds[0]);
    assert.ok(points.length > 10_000 && points.length <= 160 * 120, `${points.length} points`);
    const inWall = points.filter(([, , z]) => Math.abs(z - 1) < 0.02).length;
    assert.ok(inWall > 0.9 * points.length, `${inWall} of ${points.length} points are 1 m away`);
  },
  "/hapticd/cloud_reach": (clouds) => {
    const points = pointsOf(clouds.at(-1));
    assert.ok(points.length > 100 && points.length < 640 * 480, `${points.length} points`);
    for (const [, , z] of points) assert.ok(Math.abs(z - 1) < 0.02, `a point ${z} m away`);
  },
  "/hapticd/depth_image": (images) => {
    const { header, width, height, step, encoding, data } = images[0];
    assert.deepEqual([width, height, step, encoding, header.frame_id], [640, 480, 1280, "16UC1", "camera_optical"]);
    assert.equal(data.byteLength, step * height);
    const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
    const middle = view.getUint16(step * 240 + 2 * 320, true);
    assert.ok(Math.abs(middle - 1000) < 20, `the wall is ${middle} mm away`);
  },
  "/hapticd/camera_calibration": (calibrations) => {
    const { header, width, height, k, p } = calibrations[0];
    assert.deepEqual([width, height, header.frame_id], [640, 480, "camera_optical"]);
    assert.ok(k[0] > 500 && k[4] > 500 && k[8] === 1);
    assert.deepEqual([p[0], p[2], p[5], p[6], p[10]], [k[0], k[2], k[4], k[5], 1]);
  },
  "/hapticd/events": (events) => {
    for (const { level, msg, stamp } of events) {
      assert.ok([20, 30, 40].includes(level));
      assert.ok(msg.length > 0 && stamp.sec > 1_600_000_000);
    }
  },
};

/** Subscribes to everything, and returns what came. */
async function look() {
  const socket = new WebSocket(url, ["foxglove.websocket.v1", "foxglove.sdk.v1"]);
  const client = new protocol.FoxgloveClient({ ws: socket });
  const seen = { statuses: [], channels: new Map(), ticks: [] };
  const bySubscription = new Map();
  await new Promise((resolve, reject) => {
    const complete = () =>
      seen.parameters !== undefined &&
      seen.channels.size === Object.keys(checks).length &&
      [...seen.channels.values()].every(({ topic, messages }) => messages.length >= (topic === "/hapticd/events" ? 1 : PER_CHANNEL)) &&
      seen.statuses.some(({ level }) => level === 1) && seen.statuses.some(({ level }) => level === 2) &&
      seen.channels.get("/hapticd/scene").messages.some((scene) => arrowOf(scene) !== undefined) &&
      seen.channels.get("/hapticd/tick").messages.some((tick) => Math.hypot(...tick.command_force_n_in_world) > 0) &&
      seen.channels.get("/hapticd/cloud_reach").messages.at(-1).data.byteLength > 0;
    const patience = setTimeout(() => {
      const counts = [...seen.channels.values()].map(({ topic, messages }) => `${topic} ${messages.length}`);
      reject(new Error(`after ${PATIENCE_MS} ms: ${counts.join(", ")}; ${JSON.stringify(seen.statuses)}`));
    }, PATIENCE_MS);
    const done = () => {
      if (!complete()) return;
      clearTimeout(patience);
      resolve();
    };
    client.on("error", reject);
    client.on("serverInfo", (info) => {
      assert.deepEqual(info.capabilities, ["parameters"]);
      assert.ok(info.sessionId.length > 0 && info.name.startsWith("hapticd"));
      client.getParameters([], "get-all-params");
      client.setParameters([{ name: "force.radius_m", value: 1 }]);
      client.subscribeConnectionGraph();
      socket.send("no JSON");
    });
    client.on("parameterValues", ({ parameters, id }) => {
      assert.equal(id, "get-all-params");
      seen.parameters = new Map(parameters.map(({ name, value }) => [name, value]));
      done();
    });
    client.on("status", (status) => (seen.statuses.push(status), done()));
    client.on("advertise", (channels) => {
      for (const channel of channels) {
        assert.equal(channel.encoding, "cdr");
        assert.equal(channel.schemaEncoding, "ros2msg");
        if (!channel.schemaName.startsWith("hapticd_msgs/")) compareWithPublished(channel.schemaName, channel.schema);
        const reader = new MessageReader(parse(channel.schema, { ros2: true }));
        const known = { topic: channel.topic, reader, messages: [] };
        seen.channels.set(channel.topic, known);
        bySubscription.set(client.subscribe(channel.id), known);
      }
    });
    client.on("message", ({ subscriptionId, timestamp, data }) => {
      try {
        const channel = bySubscription.get(subscriptionId);
        const bytes = bytesOf(data);
        const message = channel.reader.readMessage(bytes);
        channel.messages.push(message);
        if (channel.topic === "/hapticd/tick") seen.ticks.push(Buffer.from(bytes).toString("base64"));
        assert.ok(timestamp > 1_600_000_000_000_000_000n);
        done();
      } catch (error) {
        reject(error);
      }
    });
  });
  client.close();
  return seen;
}

try {
  assert.equal(await chosen(["foxglove.websocket.v1", "foxglove.sdk.v1"]), "foxglove.sdk.v1");
  assert.equal(await chosen(["foxglove.websocket.v1"]), "foxglove.websocket.v1");
  assert.equal(await chosen(["foxglove.websocket.v2"]), "400");
  const seen = await look();
  assert.equal(typeof seen.parameters.get("force.radius_m"), "number");
  assert.ok(seen.parameters.size > 50);
  for (const [topic, check] of Object.entries(checks)) check(seen.channels.get(topic).messages, seen.parameters);
  await writeFile(file, JSON.stringify(seen.ticks));
  process.exit(0);
} catch (error) {
  console.error(error.stack);
  process.exit(1);
}
