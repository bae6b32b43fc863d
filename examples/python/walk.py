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


async def listen(socket, welcome, pictures):
    """Reads messages; prints why there are no pictures, and puts each picture's header and file into a queue."""
    async for message in socket:
        if isinstance(message, bytes):
            length = int.from_bytes(message[:4], "little")
            if length:
                header, file = json.loads(message[4 : 4 + length]), b""
            file += message[4 + length :]
            whole = len(file) == header["bytes"]
            answer = {"type": "shown", "number": header["number"], "age_ms": 0} if whole else {"type": "received"}
            await socket.send(json.dumps(answer))
            if whole:
                pictures.put_nowait((header, file))
        elif (message := json.loads(message))["type"] == "welcome":
            welcome.set_result(message)
        elif message["type"] != "alive":
            print(message.get("detail") or message.get("reason") or message["type"])
    raise SystemExit("the gateway has closed the connection")


async def still(pictures, number, light_steps):
    """The last still of a pose: of the view's own cell, in finished light, and not renewed for some seconds."""
    header, file = {"number": 0}, b""
    while True:
        finished = header["number"] == number and not header["neighbour"] and header["light_step"] == light_steps
        try:
            header, file = await asyncio.wait_for(pictures.get(), FOLLOW_S if finished else None)
        except asyncio.TimeoutError:
            return header, file


async def walk(address, count):
    async with websockets.connect(address, subprotocols=["myriorama.v1"], max_size=None) as socket:
        await socket.send(json.dumps({"type": "open", "scene": None}))
        welcome, pictures = asyncio.get_running_loop().create_future(), asyncio.Queue()
        # A task without a name may be collected.
        listening = asyncio.create_task(listen(socket, welcome, pictures))
        home, light_steps = (await welcome)["home"], welcome.result()["light_steps"]
        for number in range(1, count + 1):
            camera = around(home, (number - 1) / count)
            pose = {"type": "pose", "number": number, "camera": camera, "canvas_px": [640, 360], "still": True}
            await socket.send(json.dumps(pose))
            header, file = await still(pictures, number, light_steps)
            name = f"walk_{number:03}.png"
            with open(name, "wb") as out:
                out.write(file)
            print(name, header["compositor"], f"{header['times_ms']['gateway']:.0f} ms")
        listening.cancel()


if __name__ == "__main__":
    asyncio.run(walk(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 12))
