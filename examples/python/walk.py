"""Walks around a scene and writes the pictures: a client of docs/viewer-protocol.md.

    pip install websockets
    python walk.py ws://127.0.0.1:7420/api/v1/socket 12
"""

import asyncio
import json
import math
import sys

import websockets

# View cells follow a visitor who rests: a nearer one brings a better picture.
FOLLOW_S = 4


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


async def still(socket, number, light_steps):
    """The last still of a pose: of the view's own cell, in finished light, and not renewed for some seconds."""
    header, file = {"number": 0}, b""
    while True:
        finished = header["number"] == number and not header["neighbour"] and header["light_step"] == light_steps
        try:
            header, file = await asyncio.wait_for(picture(socket), FOLLOW_S if finished else None)
        except asyncio.TimeoutError:
            return header, file
        await socket.send(json.dumps({"type": "shown", "number": header["number"], "age_ms": 0}))


async def walk(address, count):
    async with websockets.connect(address, subprotocols=["myriorama.v1"], max_size=None) as socket:
        await socket.send(json.dumps({"type": "open", "scene": None}))
        welcome = json.loads(await socket.recv())
        while welcome["type"] != "welcome":
            print(welcome.get("detail") or welcome.get("reason"))
            welcome = json.loads(await socket.recv())
        for number in range(1, count + 1):
            camera = around(welcome["home"], (number - 1) / count)
            pose = {"type": "pose", "number": number, "camera": camera, "canvas_px": [640, 360], "still": True}
            await socket.send(json.dumps(pose))
            header, file = await still(socket, number, welcome["light_steps"])
            name = f"walk_{number:03}.png"
            with open(name, "wb") as out:
                out.write(file)
            print(name, header["compositor"], f"{header['times_ms']['gateway']:.0f} ms")


if __name__ == "__main__":
    asyncio.run(walk(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 12))
