!> Template scenes (input files to begin from), which `impactbeam --new KIND` prints.
module scene_templates
   use printable_text, only: joined
   implicit none (type, external)
   private
   public :: template_kinds, template_text

   !> Kinds of template scenes; the constants of these names are their lines.
   character(*), parameter :: template_kinds(4) = [character(5) :: 'beam', 'relay', 'tube', 'reed']

   character(*), parameter :: beam(*) = [character(80) :: &
      '! A clamped beam is displaced from a stop at its tip and released. Values are', &
      '! dimensionless: times are multiplied by the first circular frequency omega1,', &
      '! displacements divided by the initial one. --names explains every name.', &
      '&mesh elements = 16 /', &
      '&damping zeta = 0.01 /          ! of the first mode', &
      '&stop', &
      '   restitution = 0.6            ! velocity after an impact over that before it', &
      '   preload = 0.1                ! height of the stop; negative: a gap at rest', &
      '/', &
      '&response', &
      '   duration = 20.0              ! 2 pi is a period of the first mode', &
      '   step = 0.01                  ! between samples; the motion needs no step', &
      '/', &
      '&frequencies count = 6 /        ! leave it out if you need no frequencies']

   character(*), parameter :: relay(*) = [character(80) :: &
      '! The reed of a relay is released above its contact, closes it, and bounces.', &
      '! SI units. More damping and a higher contact, which presses more on the reed,', &
      '! reduce the bounce.', &
      "&scene units = 'SI', title = 'A relay closes' /", &
      '&beam', &
      '   length = 20.0e-3             ! m', &
      '   width = 4.0e-3               ! m', &
      '   height_root = 0.3e-3         ! m; height_tip makes a taper', &
      '   youngs_modulus = 205.0e9     ! Pa', &
      '   density = 7850.0             ! kg/m^3', &
      '/', &
      '&mesh elements = 16 /', &
      '&damping stiffness_coefficient = 2.0e-6 /  ! s', &
      '&tip_mass mass = 20.0e-6 /      ! kg, the contact bead', &
      '&stop', &
      '   surface_height = 0.1e-3      ! m, above the unstressed reed: it presses', &
      '   initial_height = 0.5e-3      ! m, above the unstressed reed: released here', &
      '! To sweep the contact height with a fixed gap of 0.4 mm, replace both heights', &
      '! by &scene displacement_scale = 0.4e-3 (m), and here preload = 0.25', &
      "   law = 'three_element'        ! a spring, in parallel a spring and damper", &
      '   stiffness = 1.7e6            ! N/m', &
      '   branch_stiffness = 3.4e6     ! N/m', &
      '   damper = 30.0                ! N s/m', &
      '/', &
      '&response duration_time = 6.0e-3, step_time = 1.0e-6 /  ! s', &
      '&relay lasting_force = 0.05 /   ! N; bounce time, force of the closed contact', &
      '&stress position = 0.0 /        ! the stress at the root']

   character(*), parameter :: tube(*) = [character(80) :: &
      '! A tube of a heat exchanger is shaken by its flow and rattles in supports with', &
      '! clearance. SI units. &statistics reports forces and impacts at each support,', &
      '! averaged from start_time on.', &
      "&scene units = 'SI', title = 'A tube rattles in its supports' /", &
      "&section shape = 'tube', outer_diameter = 15.9e-3, wall = 1.15e-3 /  ! m", &
      '&beam length = 1.2, youngs_modulus = 207.0e9, density = 7870.0 /', &
      '&mesh elements = 16 /', &
      '&damping zeta = 0.005 /', &
      '! the supports, at 0.6 and 1.2 m, with clearance on both sides', &
      '&stop', &
      "   position = 0.5, side = 'both', clearance = 1e-4       ! of the length; m", &
      "   law = 'spring_damper', stiffness = 1e5, damper = 0.3  ! N/m, N s/m", &
      '/', &
      '&stop', &
      "   position = 1.0, side = 'both', clearance = 2e-4", &
      "   law = 'spring_damper', stiffness = 1e5, damper = 0.3", &
      '/', &
      '! the flow: 20 N/m along the outer half, 30 times a second', &
      '&force stretch = 0.5, 1.0, amplitude = 20.0, frequency = 30.0 /', &
      "&start kind = 'rest' /", &
      '&response duration_time = 0.5, step_time = 2.0e-4 /', &
      '&statistics start_time = 0.1 /  ! s']

   character(*), parameter :: reed(*) = [character(80) :: &
      '! The reed of a valve is driven by pressure between its seat and a stop above', &
      '! it. SI units. Valve reeds fail by fatigue at the root: the run reports the', &
      '! maximum and the range of the stress; fatigue_slope in &stress counts cycles.', &
      "&scene units = 'SI', title = 'A valve reed between seat and stop' /", &
      '&beam', &
      '   length = 40.0e-3, width = 10.0e-3, height_root = 0.4e-3  ! m', &
      '   youngs_modulus = 210.0e9, density = 7850.0               ! Pa, kg/m^3', &
      '/', &
      '&mesh elements = 16 /', &
      '&damping stiffness_coefficient = 4.0e-6, mass_coefficient = 20.0 /  ! s, 1/s', &
      '! the seat below the tip, and the stop 1.5 mm above it', &
      '&stop position = 1.0, surface_height = 0.0, restitution = 0.3 /', &
      '&stop', &
      "   position = 0.8, side = 'above', surface_height = 1.5e-3, restitution = 0.4", &
      '/', &
      '! the pressure, 50 times a second: 100 N/m along the outer half', &
      '&force stretch = 0.5, 1.0, amplitude = 100.0, frequency = 50.0 /', &
      "&start kind = 'rest' /", &
      '&response duration_time = 40.0e-3, step_time = 2.0e-5 /', &
      '&stress position = 0.0 /']

contains

   !> Text of a template scene, lines ended by new_line('a'); empty if `kind` is not one of `template_kinds`.
   pure function template_text(kind) result(text)
      character(*), intent(in) :: kind
      character(:), allocatable :: text

      character, parameter :: next = new_line('a')

      select case (kind)
      case ('beam')
         text = joined(beam, next)//next
      case ('relay')
         text = joined(relay, next)//next
      case ('tube')
         text = joined(tube, next)//next
      case ('reed')
         text = joined(reed, next)//next
      case default
         text = ''
      end select
   end function template_text

end module scene_templates
