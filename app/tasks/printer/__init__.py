"""The printer task: a robot on a rail opens a 3D printer's door, and takes the printed part."""

from regrasp.app.task.part import Part
from regrasp.app.task.task import Task
from regrasp.app.task.technique import Technique

_HERE = "regrasp.app.tasks.printer"

TASK = Task(
    name="printer",
    about="Open the door of a habitat's 3D printer with a robot on a rail, and take the part.",
    objects=Part("regrasp.sim.printer.objects:PrinterObjects"),
    cell=Part("regrasp.interfaces.printer.cell:PrinterCell"),
    cell_findings=Part(f"{_HERE}.cell_layout:cell_findings"),
    cell_names=Part(f"{_HERE}.cell_names:cell_names"),
    expect=Part(f"{_HERE}.expectations:Expect"),
    causes=Part("regrasp.interfaces.printer.cause:PrinterCause"),
    when=Part("regrasp.interfaces.printer.fault:PrinterWhen"),
    faults=Part("regrasp.interfaces.printer.fault:FAULTS"),
    service_calls=("motion.reach", "motion.servo", "motion.slide_door", "motion.take_part", "perception.part_tracker"),
    services=Part(f"{_HERE}.services:printer_services"),
    judge=Part(f"{_HERE}.judge:PrinterJudge"),
    words=Part(f"{_HERE}.words:WORDS"),
    techniques={
        "printer_part": Technique(
            "the printed part, its section and the fingers in the picture", Part(f"{_HERE}.perceive:perceive_part")
        )
    },
    commands=Part(f"{_HERE}.commands:add_commands"),
)
