"""Plant and estimator as one system of SSP 1.0, crane.ssp, for tools that read it: `python ssp.py`, after co_simulation.py.

Connections are by name: the samples of the plant go to the estimator; the commands are inputs of the system and go to both.
FMPy reads the file, checks it against the schema and runs it.
"""

import sys
import zipfile
from xml.sax.saxutils import quoteattr

from fmpy import read_model_description
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd

FILES = {"plant": "plant.fmu", "estimator": "rail_fusion.fmu"}
SHOWN = ("grade", "grade_sd", "total_mass", "total_mass_sd", "speed")
HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
 xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" version="1.0" name="crane">
<ssd:System name="crane">
"""
TAIL = """</ssd:System>
<ssd:DefaultExperiment startTime="0" stopTime="40"/>
</ssd:SystemStructureDescription>
"""


def connector(name: str, kind: str) -> str:
    return f'<ssd:Connector name={quoteattr(name)} kind="{kind}"><ssc:Real/></ssd:Connector>\n'


def connection(start: tuple[str, str], end: tuple[str, str]) -> str:
    ends = []
    for side, (element, name) in (("start", start), ("end", end)):
        ends += [f'{side}Element="{element}"'] if element else []
        ends.append(f"{side}Connector={quoteattr(name)}")
    return f"<ssd:Connection {' '.join(ends)}/>\n"


def make(file: str) -> None:
    of = {}
    for element, fmu in FILES.items():
        variables = read_model_description(fmu).modelVariables
        of[element] = {c: [v.name for v in variables if v.causality == c and v.type == "Real"] for c in ("input", "output")}
    plant, estimator = of["plant"], of["estimator"]
    samples = [name for name in plant["output"] if name in estimator["input"]]
    commands = plant["input"]
    xml = HEAD + "<ssd:Connectors>\n"
    xml += "".join(connector(name, "input") for name in commands) + "".join(connector(name, "output") for name in SHOWN)
    xml += "</ssd:Connectors>\n<ssd:Elements>\n"
    for element, fmu in FILES.items():
        xml += f'<ssd:Component name="{element}" type="application/x-fmu-sharedlibrary" source="resources/{fmu}">\n<ssd:Connectors>\n'
        xml += "".join(connector(name, kind) for kind in ("input", "output") for name in of[element][kind])
        xml += "</ssd:Connectors>\n</ssd:Component>\n"
    xml += "</ssd:Elements>\n<ssd:Connections>\n"
    xml += "".join(connection(("plant", name), ("estimator", name)) for name in samples)
    xml += "".join(connection(("", name), ("plant", name)) for name in commands)
    xml += "".join(connection(("", name), ("estimator", name)) for name in commands if name in estimator["input"])
    xml += "".join(connection(("estimator", name), ("", name)) for name in SHOWN)
    xml += "</ssd:Connections>\n" + TAIL
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("SystemStructure.ssd", xml)
        for fmu in FILES.values():
            archive.write(fmu, f"resources/{fmu}")


if __name__ == "__main__":
    make("crane.ssp")
    read_ssd("crane.ssp")
    print("crane.ssp is a system of SSP")
    step_s = float(read_model_description("plant.fmu").defaultExperiment.stepSize)
    result = simulate_ssp("crane.ssp", stop_time=2.0, step_size=step_s)
    missing = [name for name in SHOWN if name not in result.dtype.names]
    if missing:
        sys.exit(f"FMPy has no result for {', '.join(missing)}")
