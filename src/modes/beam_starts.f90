!> Initial displacements and velocities of the beam. A table of values at points along the beam is interpolated by a
!> cubic spline; the initial motion of the finite elements is its projection, weighted by the mass (docs/theory.md,
!> section 18).
module beam_starts
   use beam_loads, only: base_mass_vector, base_rotation_vector, piecewise_cubic_t, inertia_of_curve, curve_value
   use beam_model, only: beam_model_t
   use cubic_splines, only: spline_slope
   use failures, only: fail, failure_t, status_bad_input
   use kinds, only: wp
   use load_settings, only: field_rotation, field_uniform, start_drop, start_settings_t, start_table, start_velocity
   use number_text, only: rounded, to_text
   implicit none (type, external)
   private
   public :: find_start_momenta, curve_of_table, check_table_of_start

   !> Distance from the root, over L, below which a point of a table counts as the root.
   real(wp), parameter :: root_tolerance = 1.0e-9_wp

   !> A table may deviate from zero by this fraction of its largest magnitude at a point where the beam is fixed.
   real(wp), parameter :: max_deviation = 1.0e-6_wp

contains

   !> Momenta M y and M y' (M: mass matrix, ': d/dtau) of a start with a velocity, after a fall or from a table; zero
   !> for all other starts.
   pure subroutine find_start_momenta(model, start, displacement, velocity)
      type(beam_model_t), intent(in) :: model
      type(start_settings_t), intent(in) :: start
      !> M y, [degrees of freedom]
      real(wp), intent(out) :: displacement(:)
      !> M y', [degrees of freedom]
      real(wp), intent(out) :: velocity(:)

      displacement = 0.0_wp
      velocity = 0.0_wp
      select case (start%kind)
      case (start_velocity)
         if (start%field == field_uniform) velocity = start%velocity*base_mass_vector(model)
         if (start%field == field_rotation) velocity = start%velocity*base_rotation_vector(model)
      case (start_drop)
         ! The velocity of a fall is positive downwards
         velocity = -start%velocity*base_mass_vector(model)
      case (start_table)
         if (allocated(start%displacements)) displacement = inertia_of_curve(model, &
            curve_of_table(model, start%position, start%displacements))
         if (allocated(start%velocities)) velocity = inertia_of_curve(model, &
            curve_of_table(model, start%position, start%velocities))
      end select
   end subroutine find_start_momenta

   !> The spline through the points of a table. Its slope is zero at its first point if the root cannot rotate.
   !> Otherwise, and at its last point, its curvature is zero; beyond the points the curve is straight. A fixed root is
   !> one of the points, whether or not the table contains it.
   pure type(piecewise_cubic_t) function curve_of_table(model, position, values) result(curve)
      type(beam_model_t), intent(in) :: model
      !> Positions x/L, ascending, two or more
      real(wp), intent(in) :: position(:)
      !> Values at these positions
      real(wp), intent(in) :: values(:)

      if (position(1) > root_tolerance .and. model%root_dofs(1) == 0) then
         curve = piecewise_cubic_t(position=[0.0_wp, position], value=[0.0_wp, values])
      else
         curve = piecewise_cubic_t(position=position, value=values)
      end if
      curve%slope = spline_slope(curve%position, curve%value, [model%root_dofs(2) == 0, .false.])
   end function curve_of_table

   !> Refuse a table whose displacements or velocities are not zero where the beam is fixed.
   subroutine check_table_of_start(model, start, error)
      type(beam_model_t), intent(in) :: model
      type(start_settings_t), intent(in) :: start
      !> Set if the table is refused
      type(failure_t), allocatable, intent(inout) :: error

      if (start%kind /= start_table) return
      if (allocated(start%displacements)) call check_column(model, start%position, start%displacements, &
         'displacements', error)
      if (allocated(start%velocities) .and. .not. allocated(error)) call check_column(model, start%position, &
         start%velocities, 'velocities', error)
   end subroutine check_table_of_start

   !> Check one column of the table.
   subroutine check_column(model, position, values, column_name, error)
      type(beam_model_t), intent(in) :: model
      real(wp), intent(in) :: position(:)
      real(wp), intent(in) :: values(:)
      !> Name of the column, for the message
      character(*), intent(in) :: column_name
      type(failure_t), allocatable, intent(inout) :: error

      type(piecewise_cubic_t) :: curve
      real(wp) :: deviation
      integer :: k

      curve = curve_of_table(model, position, values)
      if (model%root_dofs(1) == 0) call check_point(0.0_wp)
      ! Springs, and supports that fix a rotation (even degrees of freedom), leave the displacement free
      do k = 1, size(model%supports)
         associate (support => model%supports(k))
            if (support%stiffness > 0.0_wp .or. modulo(support%dof, 2) == 0 .or. allocated(error)) cycle
            call check_point(model%mesh%position((support%dof + 1)/2))
         end associate
      end do

   contains

      !> Refuse the table if its curve is not zero at x.
      subroutine check_point(x)
         real(wp), intent(in) :: x

         deviation = curve_value(curve, x)
         if (abs(deviation) <= max_deviation*maxval(abs(values))) return
         call fail(error, status_bad_input, column_name//' of the table are '//rounded(deviation/maxval(abs(values))) &
            //' of the maximum at x/L = '//to_text(x)//', where the beam is held: give a point with 0 there; up to ' &
            //to_text(max_deviation)//' of the maximum is taken as that')
      end subroutine check_point
   end subroutine check_column

end module beam_starts
