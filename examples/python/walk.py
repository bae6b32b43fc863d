"""Walks around a scene and writes the pictures: a client of docs/viewer-protocol.md.

    pip install websockets
    python walk.py ws://127.0.0.1:7421/api/v1/socket 12
"""

import asyncio
import json
import math
import sys

import websockets


def around(home, share):
    """The home camera, turned around its target by a share of the circle."""
    (ex, ey, ez), (tx, ty, tz) = home["eye"], home["target"]
    angle = 2 * math.pi * share
    x, z = ex - tx, ez - tz
    turned = (x * math.cos(angle) + z * math.sin(angle), z * math.cos(angle) - x * math.sin(angle))
    return {**home, "eye": [tx + turned[0], ey, tz + turned[1]]}


async def picture(socket):
    """The next picture's header and file; says why there is none meanwhile."""
    async for message in socket:
        if isinstance(message, bytes):
            length = int.from_bytes(message[:4], "little")
            return json.loads(message[4 : 4 + length]), message[4 + length :]
        message = json.loads(message)
        print(message.get("detail") or message.get("reason") or message["type"])
    raise SystemExit("the gateway has closed the connection")


async def walk(address, count):
    async with websockets.connect(address, subprotocols=["myriorama.v1"], max_size=None) as socket:
        await socket.send(json.dumps({"type": "open", "scene": None}))
        message = json.loads(await socket.recv())
        while message["type"] != "welcome":
            print(message.get("detail") or message.get("reason"))
            message = json.loads(await socket.recv())
        for number in range(1, count + 1):
            camera = around(message["home"], (number - 1) / count)
            pose = {"type": "pose", "number": number, "camera": camera, "canvas_px": [640, 360], "still": True}
            await socket.send(json.dumps(pose))
            header = {"number": 0, "neighbour": True}
            # A picture from a neighbouring view cell is followed by the view cell's own.
            while header["number"] < number or header["neighbour"]:
                header, file = await picture(socket)
                await socket.send(json.dumps({"type": "shown", "number": header["number"], "age_ms": 0}))
            name = f"walk_{number:03}.png"
            with open(name, "wb") as out:
                out.write(file)
            print(name, header["compositor"], f"{header['times_ms']['gateway']:.0f} ms")


if __name__ == "__main__":
    asyncio.run(walk(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 12))
