!> Frequency response of the beam without contact to harmonic loads: complex amplitudes of the steady-state motion, in
!> closed form from the modes (docs/theory.md, section 21). Frequencies are in omega1, displacements in D.
module frequency_response
   use analysis_types, only: analysis_t
   use applied_loads, only: applied_loads_t, count_forces, courses_of, gather_loads
   use beam_model, only: beam_model_t, complete_model
   use failures, only: failure_t
   use few_modes, only: find_modes_of_run
   use free_modes, only: free_modes_t
   use kinds, only: wp
   use load_settings, only: base_displacement, course_harmonic, time_course_t
   use mode_choice, only: common_zeta, select_modes
   use point_groups, only: body_points, contact_points, in_degrees, put_amplitudes
   use quantities, only: units_t
   use quantity_groups, only: quantity_group_t
   use reader_units, only: phrase
   use response_types, only: response_t
   use run_settings, only: run_settings_t
   use scene_types, only: frequency_response_settings_t, scene_t
   use stop_contacts, only: contact_t, contacts_of, shape_of_contact
   use table_columns, only: print_line
   implicit none (type, external)
   private
   public :: frequency_response_t

   !> Complex amplitudes of the displacements, relative to the base, under loads sin(omega tau + phase). A displacement
   !> is the imaginary part of amplitude exp(i omega tau).
   type, extends(analysis_t) :: frequency_response_t
      !> Frequency omega of the loads over omega1, [frequencies]
      real(wp), allocatable :: frequency(:)
      !> Amplitude of the beam at the tip, [frequencies]
      complex(wp), allocatable :: tip(:)
      !> Amplitude of the gap of each contact in the scene's order, up, [contacts, frequencies]
      complex(wp), allocatable :: stop(:, :)
      !> Amplitude of each recorded point of the model, on which no contact acts, [points, frequencies]
      complex(wp), allocatable :: points(:, :)
   contains
      procedure :: compute
      procedure :: write => write_group
      procedure :: print => print_maximum
   end type frequency_response_t

contains

   !> Compute the response at each frequency to all harmonic loads together, each with its amplitude and phase.
   subroutine compute(self, scene, model, settings, response, error)
      class(frequency_response_t), intent(inout) :: self
      !> The scene, with the group &frequency_response
      type(scene_t), intent(in) :: scene
      !> The beam
      type(beam_model_t), intent(in) :: model
      !> Its loads, stops and damping
      type(run_settings_t), intent(in) :: settings
      !> Not used
      type(response_t), intent(in) :: response
      !> Set if the modes cannot be found
      type(failure_t), allocatable, intent(out) :: error

      type(beam_model_t) :: whole
      type(free_modes_t) :: modes
      ! settings in the order of the modes
      type(run_settings_t) :: ordered
      type(applied_loads_t) :: loads
      type(contact_t), allocatable :: contacts(:)
      ! modal forces, and values of the modes at tip, recorded points and contacts, [modes, number]
      real(wp), allocatable :: damping(:), force(:, :), row(:, :)
      complex(wp), allocatable :: amplitude(:)
      integer :: i, k, mode_count

      call find_modes_of_run(model, settings, modes, error)
      if (allocated(error)) return
      mode_count = size(modes%square)
      ! a given number of modes excludes residual modes, and the higher modes of a small mesh
      if (settings%response%mode_count > 0) mode_count = min(mode_count, settings%response%mode_count)
      ordered = settings
      call select_modes(mode_count, modes, ordered)
      whole = model
      call complete_model(settings, whole)
      allocate (contacts, source=contacts_of(settings))
      call gather_loads(whole, settings, loads)
      associate (mode => modes%mode, square => modes%square, points => size(whole%points))
         force = matmul(transpose(mode), loads%vector)
         ! coefficient 2 zeta W^2 + alpha of each modal velocity
         damping = 2.0_wp*common_zeta(settings)*square + modes%rate
         allocate (row(size(square), 1 + points + size(contacts)))
         row(:, 1) = mode(modes%tip_dof, :)
         row(:, 2:1 + points) = transpose(mode(whole%points%dof, :))
         do k = 1, size(contacts)
            row(:, 1 + points + contacts(k)%number) = contacts(k)%sign*shape_of_contact(contacts(k), whole, mode)
         end do
         self%frequency = frequencies_of(scene%frequency_response)
         associate (unused => response, n => size(self%frequency))
            allocate (self%tip(n), self%points(points, n), self%stop(size(contacts), n))
         end associate
         do i = 1, size(self%frequency)
            associate (omega => self%frequency(i))
               amplitude = matmul(matmul(force, amplitudes_at(settings, omega)) &
                  /cmplx(square - omega**2, omega*damping, wp), row)
            end associate
            self%tip(i) = amplitude(1)
            self%points(:, i) = amplitude(2:1 + points)
            self%stop(:, i) = amplitude(2 + points:)
         end do
      end associate
   end subroutine compute

   !> Equally or logarithmically spaced frequencies; both ends of the range are exact.
   pure function frequencies_of(settings) result(frequency)
      type(frequency_response_settings_t), intent(in) :: settings
      real(wp) :: frequency(settings%points)

      integer :: i

      associate (lowest => settings%range(1), highest => settings%range(2), last => real(settings%points - 1, wp))
         if (settings%is_logarithmic) then
            frequency = [(lowest*(highest/lowest)**(real(i, wp)/last), i=0, settings%points - 1)]
         else
            frequency = [(lowest + (highest - lowest)*(real(i, wp)/last), i=0, settings%points - 1)]
         end if
         frequency(settings%points) = highest
      end associate
   end function frequencies_of

   !> Complex amplitudes of all loads at a frequency, in the order of `gather_loads`; zero for loads that are not
   !> harmonic.
   pure function amplitudes_at(settings, omega) result(amplitude)
      type(run_settings_t), intent(in) :: settings
      !> Frequency of all loads, over omega1
      real(wp), intent(in) :: omega
      complex(wp), allocatable :: amplitude(:)

      type(time_course_t), allocatable :: courses(:)
      integer :: forces, k

      allocate (courses, source=courses_of(settings))
      ! a load is the imaginary part of amplitude exp(i omega tau)
      amplitude = merge(cmplx(courses%amplitude*cos(courses%phase), courses%amplitude*sin(courses%phase), wp), &
         (0.0_wp, 0.0_wp), courses%kind == course_harmonic)
      forces = count_forces(settings)
      ! the load of a moving base is its acceleration
      do k = forces + 1, size(courses)
         if (settings%bases(k - forces)%quantity == base_displacement) amplitude(k) = -omega**2*amplitude(k)
      end do
   end function amplitudes_at

   !> Write the response of the displacements at each frequency: amplitudes and phases.
   subroutine write_group(self, group)
      class(frequency_response_t), intent(in) :: self
      type(quantity_group_t), intent(in) :: group

      call group%attribute('meaning', 'displacements, relative to the base, of the beam with its stops open: ' &
         //'amplitude times sin(omega t + phase), where loads have their amplitudes and phases, all at omega')
      call group%put('omega', self%frequency, 'frequency', '{omega over omega1~frequency of the loads}', &
         is_scale=.true.)
      call group%put('amplitude_tip', abs(self%tip), 'displacement', 'amplitude of the tip', 'omega')
      call group%put('phase_tip', in_degrees(self%tip), 'number', 'its phase in degrees', 'omega')
      call put_amplitudes(group, body_points, self%points)
      call put_amplitudes(group, contact_points, self%stop)
   end subroutine write_group

   !> Print the maximum amplitude of the tip.
   subroutine print_maximum(self, unit, units)
      class(frequency_response_t), intent(in) :: self
      integer, intent(in) :: unit
      !> Units of the results
      type(units_t), intent(in) :: units

      associate (amplitude => abs(self%tip), frequency => self%frequency(maxloc(abs(self%tip), dim=1)))
         call print_line(unit, 'without contact', phrase(units, 'amplitude of the tip at most ', 'displacement', &
            maxval(amplitude))//phrase(units, ', at {omega~f} = ', 'frequency', frequency))
      end associate
   end subroutine print_maximum

end module frequency_response
